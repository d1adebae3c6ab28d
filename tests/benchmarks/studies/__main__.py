"""Run a study, and write its page.

    python -m tests.benchmarks.studies exploration [--jobs N] [--quick] [--page] [--out FOLDER]

What has a record is left out: the same command goes on. With --page the page and its figure are
written from the records that are there, and nothing is run.
"""

import argparse
import sys
from pathlib import Path

from tests.benchmarks.studies.jobs import DOCS, NAMES, run, write_page


def main(argv=None):
    """Run, and write the page."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.studies", description=__doc__)
    parser.add_argument("study", choices=NAMES)
    parser.add_argument("--jobs", type=int, default=1, metavar="N", help="processes (1)")
    parser.add_argument("--quick", action="store_true", help="a first look, some minutes")
    parser.add_argument("--page", action="store_true", help="the page alone")
    parser.add_argument("--out", type=Path, default=DOCS, metavar="FOLDER", help="(docs/studies)")
    options = parser.parse_args(argv)
    if options.quick and options.out == DOCS:
        parser.error("--quick needs --out FOLDER: a first look is no result")
    if not options.page:
        run(options.study, options.out, options.jobs, options.quick)
    write_page(options.study, options.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
