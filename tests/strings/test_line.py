"""Lines exactly and in elements, against published modes and against each other."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

from drillctrl.strings.drill_string import Damping
from drillctrl.strings.elements import distance, elements, free_modes, resolved
from drillctrl.strings.line import Line, Piece, Stretch
from drillctrl.strings.presets import paper_string, string_preset

LOSSLESS = dataclasses.replace(paper_string().string, damping=Damping(0.0, 0.0, 0.0))
# Hz, of 1000 m of pipe above 200 m of collars, the top fixed, the bit free.
TORSIONAL = (0.447990, 1.689519, 3.138164, 4.617882, 6.066527, 7.308056)
AXIAL = (0.710092, 2.713952, 5.055057, 7.444943)

pieces = st.builds(
    Piece,
    st.floats(1.0, 500.0),
    st.floats(0.01, 200.0),
    st.floats(1e5, 1e9),
    st.floats(0.0, 10.0),
    st.floats(0.0, 1e-3),
)
lines = st.lists(st.tuples(st.lists(pieces, min_size=1, max_size=2), st.integers(1, 5)),
                 min_size=1, max_size=3).map(
    lambda rows: Line(tuple(Stretch(tuple(row), times) for row, times in rows))
)  # fmt: skip


@pytest.mark.parametrize(
    ("line", "modes"), [(LOSSLESS.torsion, TORSIONAL), (LOSSLESS.tension, AXIAL)]
)
def test_modes_of_the_papers_string(line, modes):
    def force(frequency):
        _, force, exponent = line.at_bit(2j * np.pi * frequency)
        return (force * np.exp(exponent)).real

    for known in modes:
        exact = brentq(force, known - 1e-3, known + 1e-3, xtol=1e-12)
        assert exact == pytest.approx(known, abs=6e-7)
    found = free_modes(elements(line), len(modes)).frequencies
    assert found == pytest.approx(modes, rel=1e-4)


def test_elements_converge_with_the_fourth_power_of_their_length():
    errors = [
        free_modes(elements(LOSSLESS.torsion, length), 6).frequencies[-1] / TORSIONAL[-1] - 1.0
        for length in (40.0, 20.0)
    ]
    assert abs(errors[0]) == pytest.approx(3e-4, rel=0.2)
    assert errors[0] / errors[1] == pytest.approx(16.0, rel=0.1)


@given(lines, st.floats(-1.0, 5.0), st.floats(-40.0, 40.0))
def test_ends_are_reciprocal_and_what_is_between_conserves_the_wronskian(line, real, imaginary):
    s = complex(real, imaginary) + 0.01
    size = np.linalg.norm(line.transfer(s), axis=(0, 1)) ** 2
    assert abs(np.linalg.det(line.transfer(s)) - 1.0) < 1e-12 * (1.0 + size)
    ends = line.port_stiffness(s)
    assert ends[0, 1] == ends[1, 0]
    # The bit's stiffness under a held top is that of the port.
    assert complex(line.bit_stiffness(s)) == pytest.approx(complex(ends[0, 0]), rel=1e-9)


@given(lines, st.floats(0.1, 60.0))
def test_a_damped_string_takes_energy(line, omega):
    ends = line.port_stiffness(1j * omega) / (1j * omega)
    power = 0.5 * (ends + ends.conj().T)
    size = np.abs(ends).max()
    assert np.linalg.eigvalsh(power).min() >= -1e-9 * size


@given(lines)
def test_slow_forces_meet_the_static_compliance(line):
    compliance = sum(
        stretch.repeats * piece.length / piece.stiffness
        for stretch in line.stretches
        for piece in stretch.pieces
    )
    assert complex(line.bit_stiffness(1e-7)) == pytest.approx(1.0 / compliance, rel=1e-4)


@pytest.mark.parametrize("name", ["paper-string", "vertical-3000"])
def test_reduced_strings_are_as_close_as_they_say(name):
    string = string_preset(name).string
    for line, frequency in ((string.torsion, 5.0), (string.tension, 8.0)):
        found, error = resolved(line, frequency, 2e-2)
        assert error == distance(line, found.matrices, frequency) <= 2e-2
        # Away from the samples too, and with another number of them.
        assert distance(line, found.matrices, frequency, 1237) < 4e-2
        static = found.matrices.bit_receptance(np.array([1e-6 + 0j]))[0]
        assert static * complex(line.bit_stiffness(1e-6)) == pytest.approx(1.0, rel=1e-6)


def test_tool_joints_slow_torsional_waves():
    drill_pipe = string_preset("deep-5000").string.sections[0]
    plain = dataclasses.replace(drill_pipe, tool_joint=None, weight=None)
    with_joints, without = (
        Line((section.torsional(0.0, 0.0),)).transit_time for section in (drill_pipe, plain)
    )
    assert 1.06 < with_joints / without < 1.12
