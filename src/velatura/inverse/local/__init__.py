"""Local search: the stack with given lobes that is nearest to a given stack, fast enough for dragging.

Coordinates describe the interfaces of a stack (`coordinates`). Newton's method moves those until the model reads the
lobes that are wished for (`newton`). Where a bound is in the way, a coordinate that is kept otherwise gives way just as
far as it must, or else the wish does, along the way to it (`dragged`). Bati et al. 2021 have the classes in which this
moves; all of it holds for any model.
"""
