"""The illuminance of the room's light on the screen."""

from lutgen.readings.conditions import Array, Column, Condition, Sketch, greys

#: Tolerance for equal room light, in lux and as a share: about the repeatability of a lux meter.
TOLERANCE_LX, TOLERANCE_SHARE = 0.5, 0.05


def _span(_values: Array, rest: float) -> tuple[float, float]:
    away = max(TOLERANCE_LX, TOLERANCE_SHARE * rest)
    return rest - away, rest + away


#: The column of the room's light.
LUX = Column(
    name="ambient_lx",
    unit="lx",
    high=200_000.0,
    meaning="the room's light in lux, from 0 on",
    blank=0.0,
    usual=0.0,
    unlogged=100.0,
    tried=(0.0, 5.0, 60.0, 400.0),
    shown=60.0,
    axis=(0.0, 300.0),
    words="room light, lux",
    shrouded=0.0,
    question="Light in the room in lux (0: dark)",
)

CONDITION = Condition(
    name="room light",
    place=2,
    columns=(LUX,),
    cell="ambient",
    span=_span,
    depends="the room's light",
    in_words=lambda at: f"room light {at['ambient_lx']:g} lx" if at["ambient_lx"] else "dark room",
    label="{:g} lx".format,
    sentence="in a room of {}",
    heading="room light",
    short="{:g} lx",
    before="in ",
    signatures=lambda values, _rest: {"room light": values["ambient_lx"] / (values["ambient_lx"] + 100.0)},
    strange=("room light",),
    sketches={
        r"light added by (room light|ambient)": Sketch(
            "viewing",
            ("ambient_lx",),
            "light per lux, as a share of white",
            "xyz + {size} * scene.ambient_lx * scene.white",
            "0.00001, (-0.001, 0.001)",
        ),
        r".*\b(room light|ambient)": Sketch(
            "optics",
            ("ambient_lx",),
            "share of the light in a bright room",
            "xyz * (1.0 + {size} * scene.ambient_lx / (scene.ambient_lx + 100.0))",
        ),
    },
    varied=(
        "black, shrouded, and black in the lit room",
        greys((0.0, 0.0, 0.0), "shrouded")
        + [((0.0, 0.0, 0.0), {"ambient_lx": lux}, "") for lux in (40.0, 120.0, 400.0)],
    ),
)
