"""`python -m simulators.conceal`: one session with a concealed mechanism, for developers and for the proof.

python -m simulators.conceal --family dual-psd --places 6 --defect encoder-eccentricity --enr 1.0 --seed 7 --out DIR
python -m simulators.conceal --list
"""

import argparse
import sys
from pathlib import Path

from simulators.conceal.case import conceal
from simulators.conceal.case_files import write_case
from simulators.conceal.wanted import FAMILIES, KINDS, ConcealError, Wanted
from simulators.defects import MECHANISMS


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m simulators.conceal", description="One session with concealed mechanisms."
    )
    parser.add_argument("--list", action="store_true", help="all mechanisms: name, physics, instruments, source")
    parser.add_argument("--family", choices=FAMILIES, default="dual-psd")
    parser.add_argument("--places", type=int, default=3, help="of the fixture; cones: seats")
    parser.add_argument("--samples", type=int, default=300)
    parser.add_argument("--arm", help="irb120, ur5, large or kr6; drawn when not given")
    parser.add_argument(
        "--defect", action="append", default=[], help="name, `any`, `outside`, `three`, `eighteen`; may be repeated"
    )
    parser.add_argument("--enr", type=float, default=1.0, help="effect over noise of each defect, after geometry")
    parser.add_argument("--noise", choices=KINDS, default="white")
    parser.add_argument("--withhold", action="store_true", help="leave out the columns that a name needs")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, help="gets recording/ and sealed/")
    return parser


def main(arguments: list[str]) -> int:
    """Writes one case. Exit code 0 good, 1 not to be drawn with this seed, 2 usage."""
    parser = _parser()
    given = parser.parse_args(arguments)
    if given.list:
        for kind in MECHANISMS:
            print(f"{kind.KIND:28} {kind.PHYSICS:26} {', '.join(kind.INSTRUMENTS):34} {kind.SIZE}")
        return 0
    if given.out is None:
        parser.error("--out is missing: the folder that gets recording/ and sealed/")
    many = {"three": ["any"] * 3, "eighteen": ["any"] * 18, "none": []}
    defects = tuple(name for word in given.defect for name in many.get(word, [word]))
    wanted = Wanted(
        family=given.family,
        seed=given.seed,
        defects=defects,
        enr=given.enr,
        samples=given.samples,
        places=given.places,
        arm=given.arm,
        noise=given.noise,
        withhold=given.withhold,
    )
    try:
        case = conceal(wanted)
    except ConcealError as reason:
        print(f"seed {given.seed}: {reason}", file=sys.stderr)
        return 1
    write_case(case, given.out)
    print(f"{given.out}: {len(case.table.pose)} samples, {len(case.hidden)} hidden")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
