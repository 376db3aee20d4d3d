# SPDX-License-Identifier: Apache-2.0
"""What the experiments came to, and what the paper gives, by name."""

PAPER = {
    "model_rate_hz": 15,
    "control_rate_hz": 600,
    "line_speed_mm_s": [6.25, 12.5, 25, 37.5, 50, 62.5, 75, 87.5, 100, 112.5, 125, 150],
    "largest_change_percent": [1.2, 2.97, 5.28, 5.66, 5, 9.09, 7.34, 8.94, 10.67, 12.52, 38, 38.01],
    "limit_percent": 10,
    "speed_at_limit_mm_s": 100,
    "mean_error_one_loop_mm": 2.33,
    "mean_error_two_loops_mm": 1.82,
    "static_error_mm": 1.4,
    "nodes": 1628,
    "elements": 4147,
}
ROBOTS = {"diamond": "config/diamond.yaml", "paper_diamond": "the paper's mesh"}
LINES = {"upwards": "Upwards", "sideways": "Sideways"}


def same(entry, **wanted):
    return all(entry[key] == value for key, value in wanted.items())


def pick(entries, loops, rate, tangent="exact", jitter=0, **wanted):
    """The only entry of those loops; wanted narrows further."""
    [entry] = [e for e in entries if same(e, loops=loops, model_rate_hz=rate, tangent=tangent, jitter=jitter, **wanted)]
    return entry


def curves(variation, line):
    [entry] = [entry for entry in variation["lines"] if entry["line"] == line]
    return entry["curves"]


def our_rate(entries):
    """The model rate that stands for what Tendril reaches: the highest tried, Hz."""
    return max(entry["model_rate_hz"] for entry in entries)


def change_at(curve, speed):
    return curve["largest_change_percent"][curve["speed_mm_s"].index(speed)]


def name(entry):
    """The loops of an entry in words."""
    text = f"{'one loop' if entry['loops'] == 1 else 'two loops'}, {entry['model_rate_hz']:g} Hz"
    return text + (" ± {:.0f} %".format(100 * entry["jitter"]) if entry["jitter"] else "")
