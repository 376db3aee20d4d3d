# SPDX-License-Identifier: Apache-2.0
"""Why figures differ from the paper's: a sentence each, with the figures that it rests on."""

from .results import PAPER, change_at, curves, pick


def of_variation(results):
    virtual = results["virtual_time"]
    variation = virtual.get("paper_diamond", virtual["diamond"])["variation"]
    robot = "the paper's mesh" if "paper_diamond" in virtual else "the diamond of this project"
    upwards = pick(curves(variation, "upwards"), 1, 15, "semidefinite")
    shown = ", ".join(f"{change_at(upwards, speed):.1f} ({theirs:g})" for speed, theirs in
                      zip(PAPER["line_speed_mm_s"][:3], PAPER["largest_change_percent"]))
    return [
        f"The paper does not say which line. Ours go {variation['line_length_mm']:g} mm from the point of rest, "
        "straight up and straight aside, at constant speed from the first instant to the last; what start and end do "
        "is in the figures.",
        "The paper measures “between two steps of the generic simulation”: that is one loop at 15 Hz. It does not say "
        "which tangent it takes for K. That of SOFA, in which its authors publish the method, follows the elements' "
        "rotation alone, R K₀ Rᵀ: the tangent called semidefinite here (<code>model_tangent</code> in the robot file), "
        "but for the stiffness of taut cables that turn. So the first column of each robot is the one to compare.",
        f"With it, upwards, on {robot}, the changes at the three lowest speeds are {shown} %, the paper's in brackets. "
        "Aside they are smaller: the figure depends on the line more than on anything else.",
        "The paper's changes leap from 12.5 to 38 % between 112.5 and 125 mm/s. Ours do not; the paper gives no reason, "
        "and we found none.",
        "Tendril's own tangent is exact. At equilibrium it is the better one, and the commands are smoother for it; but "
        "one step of several millimetres leaves stresses behind that are not there at equilibrium and stiffen it, the "
        "more so with the square of the step. Near the rate that Tendril reaches these steps are fractions of a "
        "millimetre.",
        "With two loops at 15 Hz and the exact tangent the changes run away above some 30 mm/s: the efforts that move "
        "the model were worked out on the snapshot before, so that the stiffness overshoots from step to step. The "
        "semidefinite tangent does not do that.",
        "The paper's robot had E = 150 kPa. Ours have what their robot files say (150 kPa and, on the paper's mesh, the "
        "180 kPa of the reference cases that come with it); E alone scales W by a constant, but for gravity.",
        "The drives' top speed is raised tenfold for this table, as the paper's virtual model has no drives.",
    ]


def of_square(results):
    square = results["virtual_time"]["diamond"]["square"]
    runs, speed = square["runs"], square["speed_mm_s"]
    one, jittering, two = pick(runs, 1, 15), pick(runs, 1, 15, jitter=runs[1]["jitter"]), pick(runs, 2, 15)
    late_s = 1.5 / PAPER["model_rate_hz"]
    apart = PAPER["mean_error_one_loop_mm"] - PAPER["mean_error_two_loops_mm"]
    return [
        "The paper gives neither size nor speed of its square. Ours is the demo's: 20 mm side, horizontal, "
        f"{speed:g} mm/s.",
        "The paper measured a robot of silicone, which missed even static positions by "
        f"{PAPER['static_error_mm']} mm on average. Ours is a simulated body, 10 % stiffer and 2 % heavier than the "
        "model, with damping: it errs less, whatever the control.",
        f"With one loop a command stands for the target of one to two periods ago, {1e3 * late_s:.0f} ms on average, "
        f"in which the tip should have gone {late_s * speed:.1f} mm; that is most of our {one['error_mm']['mean']:.2f} "
        f"mm. The paper's two means are {apart:.2f} mm apart, as if its tip went at about {apart / late_s:.0f} mm/s.",
        f"A period that varies by ± {100 * jittering['jitter']:.0f} % (evenly distributed, seed "
        f"{square['jitter_seed']}) adds {jittering['error_mm']['mean'] - one['error_mm']['mean']:.2f} mm to the mean. In "
        "the paper the varying step made the error accumulate over time; it does not here, since our target depends on "
        "the time and not on the number of steps.",
        f"With two loops the error at 15 Hz ({two['error_mm']['mean']:.2f} mm) is that of the stiffer body, and hardly "
        "depends on the model's rate at this speed; the map shows where it does.",
        "In the paper both strategies left oscillations of the soft body. Ours has more damping "
        "(<code>plant.damping_stiffness</code>, <code>damping_mass</code>), and the commands of two loops excite "
        "little.",
    ]


def of_command():
    return [
        "The paper shows its command as a curve without a figure. Ours is a definition of our own: roughness is the root "
        "mean square, over cycles and cables, of the second difference of the command at the control rate, mm/s².",
        "The paper says that the efforts λ of the solution are sent. Ours are its lengths δ, which servo drives that "
        "hold a position can take, and which a wrong E spoils less.",
    ]


def of_rates():
    return [
        "The paper needs 67 ms for a step of its model; docs/model.md tells what a refresh costs here and why.",
        "In virtual time a refresh takes the whole period, as the paper's did. In real time, throttled to 15 Hz, it is "
        "ready after some milliseconds, and its snapshot is fresher.",
        "In virtual time errors are those of the body itself at every time step. In real time they are what its camera "
        "measured, held against the path at the instant of exposure.",
        "Figures in real time depend on the machine and differ a little from run to run.",
    ]
