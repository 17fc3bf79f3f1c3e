"""`velatura schema`: the JSON Schema of material files, for editors that check while one types."""

from __future__ import annotations

import json


def schema() -> None:
    """Print the JSON Schema of material files."""
    from velatura.stack import json_schema

    print(json.dumps(json_schema(), indent=2))
