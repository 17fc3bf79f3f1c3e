"""Phase functions of the media of a material."""
