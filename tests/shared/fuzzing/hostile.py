"""Names that would run as code, or leave their place, wherever they are put into a text unescaped."""

from __future__ import annotations

import base64
import json
import zlib
from typing import Any

NAMES = (
    "<img src=x onerror=hacked()>",
    '"><script>hacked()</script>',
    "javascript:hacked()",
    "${hacked()}",
    "</title><svg onload='hacked()'>",
    "\u202egpj.exe \u2066\u200f",
    "' onfocus='hacked()' autofocus x='",
    "a" * 500,
    "..\\..//%2e%2e/x",
    'x"; filename=evil.exe; y="',
)

#: In a page: reports code that runs, and all that a policy refuses, to the console.
WATCH = """
window.hacked = () => console.error('foreign code has run');
document.addEventListener('securitypolicyviolation', ({ violatedDirective, blockedURI, sourceFile, lineNumber }) =>
  console.error(`refused by the policy: ${violatedDirective} ${blockedURI} ${sourceFile}:${lineNumber}`));
"""

#: In a page: drops a file, by its name and its text.
DROP = """
([name, text]) => {
  const dataTransfer = new DataTransfer();
  dataTransfer.items.add(new File([text], name));
  document.body.dispatchEvent(new DragEvent('drop', { bubbles: true, cancelable: true, dataTransfer }));
}
"""


def material(name: str) -> dict[str, Any]:
    """A coated base of a name."""
    return {"name": name, "layers": [{"interface": {"eta": 1.5, "alpha": 0.1}}, {"diffuse": {"albedo": 0.5}}]}


def fragment(name: str, **others: Any) -> str:
    """The end of an address that opens a material of a name, maybe with other parts of the state."""
    text = json.dumps({"material": material(name), "model": "belcour2018", **others})
    packed = zlib.compressobj(wbits=-15)
    data = packed.compress(text.encode()) + packed.flush()
    return "#m=" + base64.urlsafe_b64encode(data).rstrip(b"=").decode()
