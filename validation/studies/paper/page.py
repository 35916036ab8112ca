"""The page of the documentation that sets the paper beside the project: docs/paper.md, from the computed numbers."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

from validation.studies.paper.beside import BLOCKS, figure_rows, number_rows
from validation.studies.paper.distance import PAPER_M
from validation.studies.paper.equations import EQUATIONS, STEPS, Row, summary

__all__ = ["page_text"]


def page_text(numbers: Mapping[str, Any], folder: str) -> str:
    """Return the page; ``folder`` is where its figures are, from the page."""
    parts = [
        *_lead(),
        *_by_function("Equations", EQUATIONS),
        *_by_function("The procedure", STEPS),
        *_figures_and_tables(),
        *_numbers(numbers),
        *_spectrum_and_table(numbers, folder),
        *_modules(numbers["fig_9"], folder),
        *_damping(numbers["fig_13"], folder),
        *_prediction(numbers["fig_13"], folder),
        *_distance(numbers["distance"], folder),
    ]
    return "\n".join([*parts, ""])


def _lead() -> list[str]:
    return [
        "# The paper side by side",
        "",
        _wrapped(
            "J. Lee, B. Lee, J. W. Song, Y. J. Lee and S. Sung, *Study on Improved Flight Coefficient Estimation and "
            "Trajectory Analysis of a Flying Disc through Onboard Magnetometer Measurements*, Sensors 18(10), 3564, "
            "2018, [doi:10.3390/s18103564](https://doi.org/10.3390/s18103564): every equation, step, figure and table "
            "with the function that "
            "implements it, every number that can be set beside one of ours, and why they differ. Page, figures and "
            "`paper/numbers.json` are made by"
        ),
        "",
        "```sh",
        "discsim study paper",
        "```",
        "",
        _wrapped(
            "in half a minute. A test makes the numbers anew and compares them and the page, and checks that each "
            "function is there and cites its equation. Our truth is the driver disc (`models/discs/driver.toml`, 179 "
            "g: the paper's 164 g and its module of 15 g); the paper prints no inertia and no coefficient of its disc."
        ),
        "",
    ]


def _by_function(title: str, rows: Sequence[Row]) -> list[str]:
    cells = [
        (
            f"({row.number})",
            row.says,
            "<br>".join(f"`{name}`" for name in row.names),
            row.departs or "as printed",
        )
        for row in rows
    ]
    names = dict.fromkeys(name for row in rows for name in row.names)
    said = [f"- `{name.rpartition('.')[2]}`: {summary(name)}." for name in names]
    return [
        f"## {title}",
        "",
        _table(("paper", "what", "function", "departs from the paper"), cells),
        "",
        "In the functions' own words:",
        "",
        *(
            textwrap.fill(line, 118, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)
            for line in said
        ),
        "",
    ]


def _figures_and_tables() -> list[str]:
    return [
        "## Figures",
        "",
        _table(("paper", "what", "ours", "remark"), figure_rows()),
        "",
        _wrapped("Fig. 12 is the structure of the simulator, from release to release of the next step. Ours:"),
        "",
        _table(("block", "function"), [(what, f"`{name}`") for what, name in BLOCKS]),
        "",
    ]


def _numbers(numbers: Mapping[str, Any]) -> list[str]:
    return [
        "## Numbers",
        "",
        _table(("where", "what", "paper", "ours", "why they differ"), number_rows(numbers)),
        "",
    ]


def _spectrum_and_table(numbers: Mapping[str, Any], folder: str) -> list[str]:
    three, seven = numbers["fig_3"], numbers["fig_7"]
    wide = seven["envelope"]
    return [
        "## Fig. 3: a whole flight",
        "",
        f"![Field of a whole flight and its spectrum]({folder}/fig-3.png)",
        "",
        _wrapped(
            f"The paper's release with {three['spin_deg_s']:.0f} deg/s, the upper end of its line. The true spin "
            f"falls from {three['true_hz'][1]:.1f} to {three['true_hz'][0]:.1f} Hz; 90 % of the line's power lie "
            f"between {three['dominant_hz'][0]:.1f} and {three['dominant_hz'][1]:.1f} Hz (paper: 9 to 10), the peak "
            f"stands at {three['peak_hz']:.1f} Hz, where the disc spends most of its time. The width is the decay of "
            f"the spin, {100 * (1 - three['true_hz'][0] / three['true_hz'][1]):.0f} % here and 10 % in the paper."
        ),
        "",
        "## Fig. 7: the rate table",
        "",
        f"![Methods on the rate table]({folder}/fig-7.png)",
        "",
        _wrapped(
            f"At 4000 deg/s the FFT is off by {seven['fft']['bias_deg_s']:.1f} deg/s, with a distortion of "
            f"{seven['fft']['sd_deg_s']:.1f} deg/s rms at a static rate: leakage from the negative frequency alone. "
            "The paper lays its own to the magnetometer's bandwidth and lost samples, neither of which is in this "
            f"run. The accelerometer of this module is off by {seven['accelerometer']['bias_deg_s']:.1f} deg/s, the "
            f"wide-range gyroscope scatters by {seven['wide_sd_deg_s']:.0f} deg/s. The envelope is "
            f"{wide['1 mm']['percent']:.1f} % wide for 1 mm and {wide['5 mm']['percent']:.0f} % for 5 mm. The paper "
            f"states 6.2 and 31 %, which is the error in d_x; under the root it is {seven['mount_percent'][0]:+.1f} "
            f"to {seven['mount_percent'][1]:+.1f} % and {seven['mount_percent'][2]:+.1f} to "
            f"{seven['mount_percent'][3]:+.1f} % of the rate."
        ),
        "",
        _wrapped(
            f"16.1 mm and +-{seven['limit_g']:.0f} g end at {seven['accelerometer_limit_deg_s']:.0f} deg/s. Of the "
            "paper's own table, which goes to 7000 deg/s, its accelerometer can have seen the lower half only, "
            "unless the miniature's sits nearer to the axis."
        ),
        "",
    ]


def _modules(found: Mapping[str, Any], folder: str) -> list[str]:
    ways = found["ways"]
    last = ways["driver: speed and spin 10 % lower with 37 g"]
    alike = sorted(one["distance"] for name, one in ways.items() if name.endswith("same speed and spin"))
    return [
        "## Fig. 9: modules of 37 g and of 15 g",
        "",
        f"![Two modules]({folder}/fig-9.png)",
        "",
        "The paper found 10 % more spin and 30 % more time and distance with the lighter module. Ours, 15 g over 37 g:",
        "",
        _table(
            (
                "release",
                "between the two throws",
                "spin",
                "time",
                "distance",
                "distance, heavier sticks out",
                "more C_D needed for 30 %",
            ),
            _ways(ways),
        ),
        "",
        _wrapped(
            f"Mass and inertia alone do not make it. A disc {100 * (found['mass'][0] / found['mass'][1] - 1):.0f} % "
            "heavier, thrown alike, sinks faster but is also slowed less: the lighter one's distance changes by "
            f"{_percent(alike[0])} to {_percent(alike[-1])}. The heavier's inertia about the axis is only "
            f"{100 * (found['Izz'][0] / found['Izz'][1] - 1):.1f} % larger, so an arm that gives the same energy "
            "gives the same spin within 0.5 %. The 10 % of spin are therefore the arm's (or the throws'), and an arm "
            f"that gives 10 % less spin gives 10 % less speed as well: that makes {100 * (last['distance'] - 1):.0f} "
            "% of distance with the driver's release. The rest is drag, as the paper says: a square board with a "
            f"bulky gyroscope that stands 4 by 1.5 cm into the wind adds {found['bluff_CD']:.3f} to C_D (C_D0 is "
            f"{found['CD0']:g}), and then it is {100 * (last['distance_with_bluff_module'] - 1):.0f} %. By the "
            "paper's own release the disc ends in a left turn that hides most of it."
        ),
        "",
        "To fly one: `discsim fly --throw paper --module mass_kg=0.037,radius_m=0.03 --out heavy`.",
        "",
    ]


def _ways(ways: Mapping[str, Any]) -> list[tuple[str, ...]]:
    """Return the rows of the two modules: what is kept alike between the throws, and what comes of it."""
    rows: list[tuple[str, ...]] = []
    for name, one in ways.items():
        release, _, way = name.partition(": ")
        more = one["more_CD_needed"]
        rows.append(
            (
                release,
                way,
                f"{_percent(one['spin'])}",
                f"{_percent(one['time'])}",
                f"{_percent(one['distance'])}",
                f"{_percent(one['distance_with_bluff_module'])}",
                "none" if more is None else f"{more:.3f}",
            )
        )
    return rows


def _damping(found: Mapping[str, Any], folder: str) -> list[str]:
    table = found["table"]
    rows = [
        (
            label,
            str(one["throws"]),
            f"{one['slope_deg_s2'][0]:.0f} to {one['slope_deg_s2'][1]:.0f}",
            f"{1000 * one['nodes'][1]:.2f} to {1000 * one['nodes'][0]:.2f}",
            f"{1000 * one['along'][1]:.2f} to {1000 * one['along'][0]:.2f}",
            f"{1000 * one['mean_along']:.2f}",
        )
        for label, one in table.items()
        if isinstance(one, Mapping) and "mean_along" in one
    ]
    return [
        "## Fig. 11 and the table (28)",
        "",
        f"![Eight throws and their table]({folder}/fig-11.png)",
        "",
        _wrapped(
            "Eight throws like the paper's, all much alike, 21.9 to 22.9 m/s and 5200 to 6500 deg/s. One slope for a "
            "whole flight makes a table proportional to 1/(r V): its corners differ by a factor of 6, whatever the "
            f"disc, and by (27) so must the paper's. The truth is {1000 * table['true_CNr']:g} e-3 everywhere. In "
            "units of 1e-3:"
        ),
        "",
        _table(
            ("spin by", "throws", "slope, deg/s2", "C_Nr over the nodes", "along the flight of Fig. 13", "its mean"),
            rows,
        ),
        "",
        _wrapped(
            "The mean weighs each instant with V r, as the yawing moment (25) does. That it comes out a third too "
            "small has two causes: the decay is fastest where V is largest, which one slope smears out, and R "
            "sin(alpha) feeds the spin (23). A throw that is beyond the accelerometer's range all the way is none to "
            "it."
        ),
        "",
        "**The paper contradicts itself here.** Its table is bounded by its experiments, 4500 to 7000 deg/s and 6 "
        "to 23 m/s.",
        _wrapped(
            "But the flight of Fig. 3 turns at 3240 to 3600 deg/s, and that of Fig. 9, with the miniature module of "
            "the field tests, starts at 4200 deg/s and slows down from there: neither has a value in the table. Our "
            "driver's 24 m/s and 4200 deg/s has none either. A release of 22.9 m/s and 5800 deg/s has, from hand to "
            f"ground ({table['flight']['rate_deg_s'][0]:.0f} to {table['flight']['rate_deg_s'][1]:.0f} deg/s, "
            f"{table['flight']['speed_m_s'][0]:.1f} to {table['flight']['speed_m_s'][1]:.1f} m/s)."
        ),
        "",
    ]


def _prediction(found: Mapping[str, Any], folder: str) -> list[str]:
    rows = [
        (
            label,
            f"{one['spin_deg_s']:.0f}",
            one["reason"] or f"{one['landing_m']:.2f}",
            "" if one["track_m"] is None else f"{one['track_m']:.2f}",
        )
        for label, one in found["predicted"].items()
    ]
    gps = found["gps"]
    moves = [(name, f"{metres:.2f}") for name, metres in found["moves_m"].items()]
    return [
        "## Fig. 13: flown by (28)",
        "",
        f"![Predicted flights]({folder}/fig-13.png)",
        "",
        _wrapped(
            "The paper's attitude, 22.9 m/s to 112 deg, 10 deg up, 5800 deg/s. As in the paper each prediction has "
            "its source's table (28) and spin at release, the latter from the straight line at t = 0; the rest of "
            "the release is true, but for the last but one, whose velocity is a receiver's first fix, with the climb "
            "by the throwing angle."
        ),
        "",
        _table(("prediction", "spin at release, deg/s", "touch-down off by, m", "track off by (rms), m"), rows),
        "",
        _wrapped(
            "The order is the paper's: the magnetometer's prediction is nearest, the accelerometer's departs with "
            "its mount error. The sizes are not: even 5 mm cost less than a metre, for this release is hardly "
            "sensitive to spin. A table that is a third off costs centimetres; with the true C_Nr the flight ends "
            "farther off, because the line's spin at release is 2 % too small and the weaker damping makes up for "
            "that."
        ),
        "",
        _wrapped(
            "**Release by GPS.** The first fix comes up to 0.1 s after the disc has left the hand, by when drag has "
            f"taken {-gps['speed_error_m_s'][0]:.1f} m/s on average. Over 400 receivers of the data sheet's noise the "
            f"touch-down is off by {gps['median_m']:.1f} m (median; 95 % below {gps['worst_95_m']:.1f} m), all else "
            "true: more than any of the paper's sources of spin. That is what decides how near a predicted path "
            "comes to a measured one. One unit of each part of the release moves the touch-down by:"
        ),
        "",
        _table(("changed by", "m"), moves),
        "",
    ]


def _distance(found: Mapping[str, Any], folder: str) -> list[str]:
    def listed(values: Sequence[float], unit: str) -> str:
        return " or ".join(f"{value:.3g} {unit}".strip() for value in values) or "none"

    unknowns = found["unknowns"]
    rows = [
        (
            name,
            f"{one['taken']:g} {one['unit']}".strip(),
            f"{one['range'][0]:g} to {one['range'][1]:g}",
            f"{one['least_m']:.0f} to {one['most_m']:.0f}",
            listed(one["needed"], one["unit"]),
            listed(one["needed_at_23"], one["unit"]),
        )
        for name, one in sorted(unknowns.items(), key=lambda item: -item[1]["most_m"])
    ]
    can = [name for name, one in unknowns.items() if one["needed"]]
    discs = ", ".join(f"{name} {metres:.0f}" for name, metres in found["discs"].items())
    undamped = ", ".join(f"{name} {a:.1f} and {b:.1f}" for name, (a, b) in found["undamped_m"].items())
    return [
        f"## {found['m']:.0f} m against {PAPER_M:.0f} m",
        "",
        f"![Distance with one unknown at a time]({folder}/distances.png)",
        "",
        _wrapped(
            f"The paper's release, as far as it is printed, carries our driver {found['m']:.0f} m in {found['s']:.1f} "
            f"s; the paper maps a throw of {PAPER_M:.0f} m and repeats of 70 to 80 m. It prints neither speed nor "
            "climb, heading, inertia, nor any coefficient. What one unknown alone would have to be, the others as "
            "taken:"
        ),
        "",
        _table(("unknown", "taken", "looked through", "carries, m", "for 72 m", "for 72 m at 23 m/s"), rows),
        "",
        _wrapped(
            f"Only {_enumerated(can)} can do it. A heading of {unknowns['heading']['needed'][0]:.0f} deg contradicts "
            "nothing that is printed: 112 deg is the disc's yaw, which in this order of rotations says nothing of "
            f"where it flies, and the path still bends left. A C_L0 of {unknowns['CL0']['needed'][0]:.2f} is within "
            f"what is published. A speed of {unknowns['speed']['needed'][0]:.1f} m/s lies outside the paper's own "
            f"table, which ends at 23 m/s; there our driver carries {found['at_23_m']:.0f} m. Mass (disc and module, "
            "179 g within 10 %), drag within the published range, spin and C_Nr cannot make up for it. A CRr below "
            "zero is not what golf discs have (the ultrastar has -0.003). The shipped discs, each with all of its "
            f"own coefficients, carry, m: {discs}."
        ),
        "",
        _wrapped(
            "**C_Nr is the least of it.** The paper holds that the terminal path is greatly affected by the damping. "
            "Without any damping the touch-down moves, from the paper's and from the driver's release, by (m): "
            f"{undamped}. More in [C_Nr from throws](cnr.md)."
        ),
    ]


def _enumerated(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def _percent(ratio: float) -> str:
    """Return a ratio as a change, without the sign of a zero."""
    return f"{round(100 * (ratio - 1)) + 0:+d} %"


def _wrapped(text: str) -> str:
    return textwrap.fill(text, 118, break_long_words=False, break_on_hyphens=False)


def _table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    return "\n".join(f"| {' | '.join(line)} |" for line in (header, ["---"] * len(header), *rows))
