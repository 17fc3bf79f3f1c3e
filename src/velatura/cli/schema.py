"""`velatura schema`: the JSON Schema of material files, for text editors that check material files."""

from __future__ import annotations

import json


def schema() -> None:
    """Print the JSON Schema of material files."""
    from velatura.stack import json_schema

    print(json.dumps(json_schema(), indent=2))
