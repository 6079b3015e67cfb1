"""What hypothesis draws from: points and gains in the range that the paper studies."""

from hypothesis import strategies as st

from drillctrl import OperatingPoint, close_loop, plant_system, preset_structure

points = st.builds(
    OperatingPoint,
    omega0=st.floats(0.5, 25.0),
    delta0=st.floats(0.0, 15.0),
    psi=st.floats(0.1, 26.0),
    eta=st.floats(0.5, 3.0),
    xi=st.floats(0.0, 0.1),
    kappa=st.floats(0.0, 0.1),
    blades=st.integers(1, 8),
    lam=st.floats(0.1, 20.0),
    beta=st.floats(0.01, 1.0),
)


@st.composite
def gain_vectors(draw, structure):
    """Gain vectors within the bounds of a structure."""
    pairs = zip(structure.lower, structure.upper, strict=True)
    return [draw(st.floats(float(low), float(high))) for low, high in pairs]


@st.composite
def loops(draw):
    """Closed loops of any preset at any point."""
    structure = preset_structure(draw(st.sampled_from(["p", "case1", "pd", "case2"])))
    gains = structure.gains(draw(gain_vectors(structure)))
    return close_loop(plant_system(draw(points)), structure, *gains)
