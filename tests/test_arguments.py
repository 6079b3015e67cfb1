"""What is no argument of a public function is refused by its name, in one line, from outside."""

import warnings

import control
import numpy as np
import pytest

import drillctrl as d

SYSTEM = d.DelaySystem(
    [[0.0, 1.0], [-1.0, -0.1]],
    ([[0.0, 0.0], [0.1, 0.0]],),
    (1.0,),
    B=[[0.0], [1.0]],
    C=[[1.0, 0.0]],
)
ONE = [[1.0]]
FED_BACK = d.FeedbackStructure("p", ("y1",), [[-1.0]], ONE, [[-1.0]], ONE, ("u1",))
GAINS = {"K1": [[0.1]], "K2": [[0.0]]}
POINT = d.OperatingPoint(10.0, 1.75, 14.0)
CALLS = {
    "DelaySystem": {
        **{"A0": [[-1.0]], "delayed": (ONE,), "delays": (1.0,), "B": ONE, "C": ONE},
        **{"state_names": ("x",), "input_names": ("u",), "output_names": ("y",)},
        **{"input_delays": (0.1,), "output_delays": (0.1,), "feedback_delay": 1.0},
    },
    "FeedbackStructure": {
        **{"name": "p", "outputs": ("y1",), "K1_lower": [[-1.0]], "K1_upper": ONE},
        **{"K2_lower": [[-1.0]], "K2_upper": ONE, "inputs": ("u1",), "ties": ()},
    },
    "close_loop": {"system": SYSTEM, "feedback": FED_BACK, **GAINS, "delay": 0.5},
    "observer_control": {
        **{"system": SYSTEM, "inputs": ("u1",), "outputs": ("y1",)},
        **{"feedback": 1.0, "correction": 1.0},
    },
    "pid_control": {
        **{"system": SYSTEM, "input_name": "u1", "output_name": "y1", "proportional": 1.0},
        **{"integral": 1.0, "derivative": 1.0, "filter_time": 0.1},
    },
    "dynamic_control": {
        **{"system": SYSTEM, "inputs": ("u1",), "outputs": ("y1",), "order": 1, "bound": 1.0},
    },
    "with_actuator_lag": {"system": SYSTEM, "name": "u1", "time_constant": 0.1},
    "with_filter": {"system": SYSTEM, "outputs": ("y1",), "time_constant": 0.1, "delay": 0.1},
    "with_late_output": {"system": SYSTEM, "name": "y1", "delay": 0.1, "late_name": "late"},
    "characteristic_roots": {"system": SYSTEM, "right_of": -1.0},
    "count_right_of": {"system": SYSTEM, "line": -0.5},
    "semidiscretize": {"system": SYSTEM, "m": 4, "order": 1},
    "intervals_for": {"system": SYSTEM, "tolerance": 0.1, "order": 0},
    "pseudospectral_abscissa": {"system": SYSTEM, "epsilon": 0.01, "weights": (1.0, 1.0)},
    "real_stability_radius": {"system": SYSTEM, "weights": (1.0, 1.0), "points": 20},
    "stability_radius": {"system": SYSTEM, "weights": (1.0, 1.0), "delay_weight": 0.0},
    "parameter_margin": {"loop_at": lambda _: SYSTEM, "limit": 0.5, "points": 3},
    "frequency_response": {"system": SYSTEM, "omega": [1.0, 2.0]},
    "loop_transfer": {"system": SYSTEM, "structure": FED_BACK, **GAINS, "omega": [1.0, 2.0]},
    "loop_frd": {"system": SYSTEM, "structure": FED_BACK, **GAINS, "omega": [1.0, 2.0]},
    "to_frd": {"system": SYSTEM, "omega": [1.0, 2.0]},
    "from_control": {
        **{"plant": control.ss([[-1.0]], [[1.0]], [[1.0]], 0), "input_delay": 0.1},
        **{"output_delay": 0.1, "delayed": {1.0: [[0.1]]}, "feedback_delay": 1.0},
    },
    "lifted_system": {"system": SYSTEM, "m": 4, "order": 1},
    "pade_approximation": {"system": SYSTEM, "degree": 2, "highest_frequency": 3.0},
    "spectral_abscissas": {
        **{"point": POINT, "parameters": {"omega0": [9.0, 10.0]}},
        **{"structure": d.preset_structure("p"), "gains": [[0.1], [0.2]], "workers": 1},
    },
    "linear_axis": {"name": "omega0", "low": 1.0, "high": 2.0, "count": 3},
    "RigPoint": {"rig": d.table1(), "rotary_speed": 12.0, "penetration_rate": 0.005, "units": "si"},
    "string_preset": {"name": "deep-5000"},
}
STRANGE = {
    "None": None,
    "word": "abc",
    "unit": "1 rpm",
    "bytes": b"x",
    "nan": float("nan"),
    "huge": 10**400,
    "large": 1e308,
    "tiny": 1e-300,
    "negative": -5,
    "truth": True,
    "complex": 1j,
    "nothing": [],
    "mapping": {0: 0},
    "set": {"y1"},
    "ragged": [[1, 2], [3]],
    "square": np.zeros((3, 3)),
    "empty": np.zeros((0, 0)),
    "unknown": np.full((2, 2), np.nan),
    "scalar": np.array(3.0),
    "cube": np.zeros((1, 1, 1)),
    "words": ("abc", "abc"),
    "holes": [None],
    "object": object(),
    "system": d.DelaySystem([[-1.0]]),
}


@pytest.mark.parametrize("name", CALLS)
def test_an_argument_of_any_kind_is_taken_or_refused_by_name(name, capfd):
    call, given = getattr(d, name), CALLS[name]
    call(**given)
    refused = set()
    for argument in given:
        for strange in STRANGE.values():
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                try:
                    call(**given | {argument: strange})
                except d.InputError as error:
                    refused.add(argument)
                    assert str(error).count("\n") == 0
                    assert len(str(error)) < 600
    # Nothing takes everything, and no library complains on its own.
    assert refused == set(given)
    assert capfd.readouterr() == ("", "")


def test_the_argument_that_is_refused_is_named():
    with pytest.raises(d.InputError, match=r"^inputs = array.*: must be a sequence"):
        d.observer_control(SYSTEM, np.zeros((3, 3)), ("y1",))
    with pytest.raises(d.InputError, match=r"^line = None: must be a finite number"):
        d.count_right_of(SYSTEM, None)
    with pytest.raises(d.InputError, match=r"^weights = \['a', 2\]: must be a sequence, each a f"):
        d.stability_radius(SYSTEM, ["a", 2])
    # A fault of the work itself is not put on arguments that are as they should be.
    with pytest.raises(ZeroDivisionError):
        d.parameter_margin(lambda _: 1 / 0, 0.5, 3)
