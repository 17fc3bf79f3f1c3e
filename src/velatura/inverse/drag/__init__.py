"""The stack with given lobes that is nearest to a given stack, fast enough for dragging.

The interfaces of a stack are described by coordinates (`coordinates`). Newton's method moves those until the model
reads the lobes that are wished for (`newton`). Where a bound is in the way, a coordinate that is kept otherwise gives
way just as far as it must, or else the wish does, along the way to it (`drag`). Bati et al. 2021 have the classes in
which this moves; all of it holds for any model.
"""

from velatura.inverse.drag.coordinates import Bound, plain
from velatura.inverse.drag.drag import DraggedStack, pinned, seen, with_depth

__all__ = ["Bound", "DraggedStack", "pinned", "plain", "seen", "with_depth"]
