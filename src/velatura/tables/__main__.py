"""Build the tables and save them with the package: `python -m velatura.tables`."""

from velatura.tables.build import build
from velatura.tables.store import save

if __name__ == "__main__":
    save(build().tables)
