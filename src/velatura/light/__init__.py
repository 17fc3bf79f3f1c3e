"""Light over bins of outgoing directions: equal squares of the projected disc, and bins about a mirror's direction."""
