"""Physics from outside the package, each in a few lines: what a user would write."""

import itertools

import casadi as ca

from drillctrl import BitRock, Load, PaperLaw, paper_plant, spring_string


class VelocityWeakening(BitRock):
    """Wear torque that falls with speed."""

    parameters = {"drop": 1.0, "decay": 1.5}

    def load(self, c, contact, rates, q):
        weight, torque = PaperLaw().load(c, contact, rates, q)
        falling = q.drop * ca.exp(-ca.fabs(rates.rotary) / q.decay)
        return Load(weight, torque + falling * contact.pressed * contact.direction)


def third_inertia(c):
    k = 2 * c.torsional_stiffness
    kinds = {"x": "length", "theta": "angle", "theta_2": "angle"}
    return spring_string(
        {**kinds, "x_top": "length", "theta_top": "angle"},
        masses={"x": c.mass, "theta": c.inertia, "theta_2": 0.5 * c.inertia},
        springs={("x", "x_top"): c.axial_stiffness, ("theta", "theta_2"): k,
                 ("theta_2", "theta_top"): k},
        dampers={"x": c.axial_damping, "theta": c.torsional_damping},
        inputs={"axial": "x", "torque": "theta", "surface": "theta_2"},
        outputs={"surface_torque": ("torque", {"theta_2": -k})},
    )  # fmt: skip


def chain(c, count=40):
    names = ["theta", *(f"theta_{i}" for i in range(2, count + 1)), "theta_top"]
    spring, damper = count * c.torsional_stiffness, 0.1 * c.torsional_damping
    pairs = list(itertools.pairwise(names))
    inner = dict.fromkeys(names[:-1], "angle")
    return spring_string(
        {"x": "length", **inner, "x_top": "length", "theta_top": "angle"},
        masses={"x": c.mass, "theta": c.inertia}
        | dict.fromkeys(names[1:-1], 0.3 * c.inertia / count),
        springs={("x", "x_top"): c.axial_stiffness} | dict.fromkeys(pairs, spring),
        dampers={"x": c.axial_damping, "theta": c.torsional_damping} | dict.fromkeys(pairs, damper),
    )


def short_chain(c):
    return chain(c, 8)


PLANTS = {
    "velocity-weakening law": (paper_plant(bit=VelocityWeakening()), "case1"),
    "third inertia, surface output": (paper_plant(string=third_inertia), "case1"),
    "40 elements": (paper_plant(string=chain), "pd"),
}
