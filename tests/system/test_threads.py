"""Velatura in many threads, as in a server or a notebook.

Rationale: Mitsuba by itself ends the process where one thread renders while another makes, drops or fails to make what
it renders with. So everything happens in a process of its own, which must end well, and every thread must see what one
alone sees.
"""

from __future__ import annotations

import subprocess
import sys

BEGIN = """
import threading, time
import numpy as np
import velatura as vt
from velatura import kernel, scenes
from velatura.errors import InvalidInput

coat, model = vt.preset("coated-gold"), "velatura"
seen, errors = {}, []

def see(name, value):
    seen.setdefault(name, set()).add(float(np.round(np.mean(value), 4)))

def render():
    see("render", vt.render(coat, model=model, spp=4, size=(24, 24), seed=3))

def together(*functions):
    def safely(function):
        try:
            function()
        except BaseException as error:
            errors.append(f"{type(error).__name__}: {error}")

    threads = [threading.Thread(target=safely, args=[function]) for function in functions]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not errors, errors
    assert all(len(values) == 1 for values in seen.values()), seen
    print(*sorted(seen))
"""

EVERYTHING = """
def walk():
    see("walk", vt.reference.statistics(coat, 0.7, paths=5_000, seed=1).energy)

def check():
    see("check", vt.check(coat, "belcour2018").passed)

def compare():
    see("compare", vt.compare(coat, ["belcour2018"], [0.7], paths=2_000, seed=2).truth.albedo)

def make():
    for alpha in (0.1, 0.2, 0.3):
        see("make", vt.bsdf(coat.replace(layer0_alpha=alpha)).flags())

def own():
    with kernel.exclusive:
        mi = kernel.mitsuba()
        scene = mi.load_dict(scenes.scene_dict("sphere", bsdf={"type": "diffuse"}, size=(16, 16)))
        see("own", mi.render(scene, spp=4, seed=1))
        del scene

together(render, walk, check, compare, make, own, render, make)
"""

DROPPED = """
model = "belcour2018"  # renders soon
waiting = [vt.bsdf("bare-gold", "reference") for _ in range(150)]

def drop():
    while waiting:
        waiting.pop()
        time.sleep(0.01)

def fail():
    def stop(done, of):
        raise ZeroDivisionError

    for call in (
        lambda: vt.render(coat, model=model, size=(16, 16), spp=2, progress=stop),
        lambda: vt.render(coat, model=model, env="none.exr"),
        lambda: vt.bsdf(coat, model="none"),
        lambda: kernel.load_dict({"type": "layered"}),
    ) * 3:
        try:
            call()
        except (InvalidInput, ZeroDivisionError) as error:
            waiting.insert(0, error)  # and with it, all that its traceback holds

together(drop, fail, *[render] * 3)
"""


def output_of(program: str) -> tuple[int, str, str]:
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    return done.returncode, done.stdout, done.stderr


def test_threads_see_what_one_alone_sees() -> None:
    """Expected: exit status 0, nothing on standard error, and the same results in all threads."""
    assert output_of(BEGIN + EVERYTHING) == (0, "check compare make own render walk\n", "")


def test_what_a_thread_drops_is_destroyed_while_nothing_is_rendered() -> None:
    """Expected: the same, where one thread lets go of BSDFs and of failures while others render."""
    assert output_of(BEGIN + DROPPED) == (0, "render\n", "")


def test_what_a_thread_drops_last_is_no_leak() -> None:
    """Expected: a BSDF that is dropped beside other threads goes with the next call, or silently with the process."""
    program = """
import threading, time, velatura as vt
material = vt.bsdf("bare-gold")
threading.Thread(target=time.sleep, args=[1]).start()
del material
assert len(vt.kernel.exclusive._dropped) == 1
material = vt.bsdf("bare-gold")
assert not vt.kernel.exclusive._dropped
del material
"""
    assert output_of(program) == (0, "", "")


def test_what_a_rendering_is_the_last_to_hold_outlives_it() -> None:
    """Expected: a BSDF whose last reference ends while Dr.Jit records, and may query it next, goes with the lock."""
    program = """
import drjit as dr, velatura as vt
mi = vt.kernel.mitsuba()
materials = [vt.bsdf("bare-gold")]

def step(i):
    materials.clear()
    return (i + 1,)

with vt.kernel.exclusive:
    dr.while_loop((mi.UInt32(0),), lambda i: i < 3, step)
    assert len(vt.kernel.exclusive._dropped) == 1
assert not vt.kernel.exclusive._dropped
"""
    assert output_of(program) == (0, "", "")
