"""A scene of Mitsuba that holds the BSDF alone, to be included in others."""

from __future__ import annotations

import json
from xml.sax.saxutils import quoteattr

from velatura.exports.request import Export, Request
from velatura.stack import dumps


def write(request: Request) -> Export:
    """The BSDF `material`; its textures are named relative to the scene's folder, where Mitsuba looks for them."""
    material = json.dumps(json.loads(dumps(request.material, "json", request.folder)), ensure_ascii=False)
    strings = {"material": material, "model": request.model.name, **request.switches}
    lines = [f'        <string name="{key}" value={quoteattr(text)}/>' for key, text in strings.items()]
    head = "<!-- Needs the plugins of Velatura: import velatura; velatura.register() -->"
    bsdf = ['    <bsdf type="layered" id="material">', *lines, "    </bsdf>"]
    return Export("\n".join(['<scene version="3.0.0">', f"    {head}", *bsdf, "</scene>", ""]))
