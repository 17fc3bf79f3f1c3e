"""JupyterLab as its users have it: a server of its own in a folder of its own, a notebook in headless Chromium."""

from __future__ import annotations

import ast
import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import velatura

NOTEBOOK = "notebook.ipynb"
PATIENCE = 120.0  # seconds to start on a busy machine

OPTIONS = (
    "--no-browser --allow-root --ServerApp.ip=127.0.0.1 --ServerApp.port=0 --IdentityProvider.token= "
    "--LabApp.expose_app_in_browser=True --LabApp.extension_manager=readonly "
    "--LabApp.check_for_updates_class=jupyterlab.NeverCheckForUpdate --LabApp.news_url=None"
)


class Lab:
    """JupyterLab with one notebook; nothing of the user's own Jupyter is read or written."""

    def __init__(self, folder: Path, cells: Sequence[str]) -> None:
        import nbformat

        self.runtime = folder / "runtime"
        root = folder / "root"
        root.mkdir()
        notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell) for cell in cells])
        notebook.metadata.kernelspec = {"name": "python3", "display_name": "Python 3", "language": "python"}
        nbformat.write(notebook, root / NOTEBOOK)
        source = str(Path(velatura.__file__).parents[1])
        places = {"JUPYTER_RUNTIME_DIR": "runtime", "JUPYTER_CONFIG_DIR": "config", "JUPYTER_DATA_DIR": "data"}
        own = {name: str(folder / place) for name, place in {**places, "IPYTHONDIR": "ipython"}.items()}
        self.log = folder / "log.txt"
        self.process = subprocess.Popen(
            [sys.executable, "-m", "jupyterlab", *OPTIONS.split(), f"--ServerApp.root_dir={root}"],
            env={**os.environ, **own, "PYTHONPATH": source},
            stdout=self.log.open("w"),
            stderr=subprocess.STDOUT,
        )

    def _found(self, pattern: str) -> Path:
        """A file that the server or the kernel writes as soon as it is there."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end and self.process.poll() is None:
            for path in self.runtime.glob(pattern):
                if path.stat().st_size:
                    return path
            time.sleep(0.1)
        raise AssertionError(f"JupyterLab says: {self.log.read_text()}")

    @property
    def address(self) -> str:
        """The address of the notebook."""
        server = json.loads(self._found("jpserver-*.json").read_text())
        return f"{server['url']}lab/tree/{NOTEBOOK}"

    @contextmanager
    def kernel(self) -> Iterator[Kernel]:
        """The notebook's own kernel."""
        from jupyter_client.blocking import BlockingKernelClient

        client = BlockingKernelClient(connection_file=str(self._found("kernel-*.json")))
        client.load_connection_file()
        client.start_channels()
        try:
            yield Kernel(client)
        finally:
            client.stop_channels()

    def stop(self) -> None:
        self.process.terminate()
        self.process.wait()


class Kernel:
    """Runs code where the notebook's cells run."""

    def __init__(self, client: Any) -> None:
        self.client = client

    def run(self, code: str, value: str = "None") -> Any:
        """Run code, then tell a value that Python can read off its `repr`."""
        reply = self.client.execute_interactive(
            code, user_expressions={"value": value}, timeout=PATIENCE, output_hook=lambda message: None
        )["content"]
        assert reply["status"] == "ok", "\n".join(reply["traceback"])
        told = reply["user_expressions"]["value"]
        assert told["status"] == "ok", "\n".join(told["traceback"])
        return ast.literal_eval(told["data"]["text/plain"])


@contextmanager
def lab(folder: Path, *cells: str) -> Iterator[Lab]:
    """JupyterLab for as long as the block runs."""
    running = Lab(folder, cells)
    try:
        yield running
    finally:
        running.stop()
