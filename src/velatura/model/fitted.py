"""Constants of the solved model that were fitted to random walks: on the half `fit` of the stacks of the benchmarks.

`python benchmarks/lobes.py --half fit --fitted NAME=VALUE` measures by another value what each was fitted by, the
distance of lobes from walks; `fidelity.py` does so for light that passes.
"""

# First and repeated facets of an interface (lobes.py) ----------------------------------------------------------------

SWING = 2.6  # how much light of repeated facets goes on in its direction, and how fast that falls as they turn it
OPAQUE_STEP = 1.4  # step of the logarithm of the index that turns as much as a reflection
BRUSHED_FROM = (
    0.3  # difference of two roughnesses, as share of the larger, from which light keeps its momentum along facets
)
BLOCKED = (0.004, 0.014)  # shares of blocked light below which, and above which, its share comes from the tables
BLOCKED_IN_THE_END = (0.9, 0.15)  # share of little blocked light that is reflected, towards a rarer medium and a denser
# Step of the logarithm of the index that refracted light which meets further facets still passes, where these are met
# often, and where such light is lost
STRAIGHT_STEP = {True: 0.04, False: 0.01}
UNDISTURBED = 0.5  # steps of the logarithm of the index, over which light of repeated facets loses the shape of a lobe
AGAIN = 1.0  # of light of repeated facets beside that of single ones, that has the shape of a lobe at most
AGAIN_POWER = 4.0  # of that minimum
# Share of the light of repeated facets without a lobe which that of a metal takes, for brushed dielectrics inside other
# media, and steps of the logarithm of their index below which that fades
ALONG, ALONG_FADE = 2.5, 0.02

# Widths (lobes.py) ---------------------------------------------------------------------------------------------------

Q = 1.52  # powers of which widths add; between Cauchy (1) and Gauss (2), as the tails of GGX ask for
# How cosines grow with roughness, in the plane and across it: of the interfaces above, and of the lobe's own
STEEPNESS = (9.0, 1.2)
OWN_STEEPNESS = (0.53, 1.5)
# Likewise of the cosine at which light that leaves meets brushed facets, and those of coats above a brushed metal
LEAVING_STEEPNESS = 3.0, 2.0
LONG = 0.6  # 1 - alpha_min / alpha_max from which facets of a metal count as long as a whole
SLIGHT_STEP = 0.2  # step of the index over the greatest one, that does not count
CORRECTION_MAX = 1.5  # logarithm of a correction
CORRECTION_FADE = 0.1  # sum of steps of the logarithm of the index below which corrections fade
# Pairs of features; of their product, what it adds to the logarithm of the width along an axis, and what, times sin^2,
# it adds to that of the width in the plane and takes from that across it
CORRECTION: tuple[tuple[tuple[str, str], float, float], ...] = (
    (("rarer", "lost"), 0.592, -0.27),
    (("brighter", "size"), -0.152, 0.081),
    (("size", "size"), 0.000246, 0.00192),
    (("rough", "rough"), -1.06, 0.657),
    (("reflected", "rarer"), -1, 2.03),
    (("size", "rough"), -0.414, 0.357),
    (("rough", "near"), -4.1, 2.44),
    (("coats", "falling"), 0.357, 0.0547),
    (("brighter", "reflected"), 0.412, 1.05),
    (("1", "rough"), -1.46, -1.01),
    (("1", "brighter"), -0.354, -1.2),
    (("brighter", "near"), -0.0709, 0.84),
    (("brighter", "brighter"), 0.145, 0.103),
    (("slant", "coats"), 0.00013, -0.328),
    (("rough", "reflected"), 0.0687, 1.13),
    (("rough", "rarer"), 1.33, -1.65),
    (("coats", "rarer"), 0.202, 0.435),
    (("rough", "index"), 0.595, -0.0434),
    (("falling", "lost"), 0.171, 0.25),
    (("brighter", "rarer"), 0.691, -0.571),
    (("brighter", "coats"), -0.0305, 0.323),
    (("coats", "coats"), -0.204, 0.18),
    (("1", "coats"), 0.224, -0.0153),
    (("1", "reflected"), 0.0243, 0.0415),
)
# In place of that, for facets that are long along an axis: of products, what they add to the logarithm of a width
BRUSHED_CORRECTION: tuple[tuple[tuple[str, str], float], ...] = (
    (("1", "1"), 0.15),
    (("slant", "across"), 0.43),
    (("slant", "coats"), -0.44),
    (("coats", "ratio"), -0.33),
)
# Powers by which that fades where coats make the width along an axis, and by which lobes turn with the plane there
COATS_MAKE = 8, 3

# Lobes that are parted below crossed facets: from where on; how the logarithm of a width along an axis changes, that of
# what lies near the mirror direction, and of the tail along the facets of its own interface; log-odds of the tail
CROSSING, CROSSING_FADE = 0.08, 0.02
NEAR_MIRROR: dict[str, float] = {"1": -0.155, "coats": 0.232, "slant": -0.102}
TAIL: dict[str, float] = {"1": 0.78, "coats": -1.01, "slant": 0.6, "slanted coats": -0.29}
TAIL_ODDS: dict[str, float] = {"1": -1.421, "slant": -0.263, "brighter": 0.808}

# Lobes of metals with long facets that are parted by how often light meets them. Of light that meets them once: what
# rough coats add to the logarithms of the widths along both axes, how that changes with their roughness, and what they
# add across the plane of incidence at grazing angles
ONCE, ONCE_ROUGH, ONCE_ACROSS = (0.18, 0.26), -0.65, 0.26
# Of light that coats throw back: the logarithms of widths beyond first order, and what rough coats add; its share, by
# how much brighter it makes the lobe, at the normal, and how much less it is at the horizon
AGAIN_WIDER, AGAIN_COATS = (1.0, 0.49), -0.56
AGAIN_SHARE = 0.94, 0.47
BLOCKED_BY_COATS = 0.28  # light of repeated facets of coats beside that of the metal's own, which such a lobe has

# Light that passes (fidelity.py) -------------------------------------------------------------------------------------

EXPONENT = 1.3  # powers of which widths of momentum add, likewise
BOUNCES = 0.3  # of the two faces of the slab that light bounces in
COS_OF_BOUNCES_MIN = 0.22  # at which slabs are crossed, for widths
WIDE = 0.05  # roughness of bounced light of which a lobe holds half
DIFFUSE_ALPHA = 0.5, 0.9  # roughness from which scattering is diffuse in part, and as a whole

# Light that is wider than lobes (wide.py): where it begins, and from where on it is all -------------------------------

WIDE_ROUGHEST = 0.1, 0.2  # roughness of the roughest interface
WIDE_SECOND = 0.01, 0.03  # step of the logarithm of the index of another one
WIDE_STRAIGHT = 0.03, 0.1  # roughness of the second one, for light that goes straight through
WIDE_STEP = 0.1  # of the logarithm of the index, below which an interface counts as a smoother one
WIDE_STRETCH = 1.1, 1.5  # ratio of two roughnesses up to which an interface counts, and from which none does
WIDE_SOLID = (
    0.02,
    0.1,
)  # of the logarithm of the index below over that above, up to which a stack is a pane, and a solid
WIDE_ERROR = 0.025, 0.12  # of waves, up to which they have all light of a direction, and from which none
