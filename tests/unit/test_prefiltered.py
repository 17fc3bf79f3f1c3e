"""Parts of a material's light by blurs of an environment, against what they are known to be."""

from __future__ import annotations

import numpy as np
import pytest

import velatura as vt
from velatura.model import named
from velatura.shader import prefiltered
from velatura.shader.prefiltered import ALPHAS, VARIANCES, Prefiltered
from velatura.stack import Material


def parts(*layers: vt.stack.Layer) -> Prefiltered:
    return prefiltered.prefiltered(Material.of(vt.Stack(list(layers))), named("velatura"))


def test_the_widest_blur_is_the_cosine() -> None:
    """Expected: a variance of 1/4 along a tangent, that of Lambert's law; less for every lower alpha."""
    assert (ALPHAS[-1], VARIANCES[0]) == (1, 0) and VARIANCES[-1] == pytest.approx(0.25, abs=1e-4)
    assert np.all(np.diff(VARIANCES) > 0)


def test_a_diffuse_base_is_its_irradiance() -> None:
    """Expected: its albedo about the normal, by the widest blur."""
    found = parts(vt.Diffuse(albedo=(0.6, 0.4, 0.2)))
    assert found.rows.shape[2] == 1 and not any(found.passes)
    np.testing.assert_allclose(found.rows[0, :, 0, :3], np.tile([0.6, 0.4, 0.2], (64, 1)), rtol=1e-3)
    np.testing.assert_allclose(found.rows[0, 32:, 0, 3:5], 0, atol=0.02)
    np.testing.assert_allclose(found.rows[0, :, 0, 5], 1, atol=0.02)


def test_a_smooth_metal_is_a_mirror_and_a_brushed_one_is_longer_across() -> None:
    """Expected: the mirror's direction, and a narrow blur; by brushing along x, light near the normal is spread along
    x, the first tangent."""
    mirror = parts(vt.Interface(conductor="mirror", alpha=0.01)).rows[0, 20:-2, 0]
    np.testing.assert_allclose(mirror[:, 3], -1, atol=0.01)
    assert np.max(mirror[:, 5] ** 2) < 0.02
    brushed = parts(vt.Interface(conductor="mirror", alpha=[0.3, 0.05]))
    at_normal = brushed.rows[0].reshape(32, 17, -1, 12)[-1, 0, 0]
    assert at_normal[6] > 0.05 and abs(at_normal[7]) < 0.02
    assert brushed.elongation[0] > 2


def test_energies_are_those_of_lobes() -> None:
    """Expected: of each interface and of the remainder, to the noise of 1,024 samples."""
    stack = vt.preset("varnished-paint")
    found = prefiltered.prefiltered(Material.of(stack), named("velatura"))
    cosine = (np.arange(64) / 63) ** 2
    lobes = vt.lobes(stack, cosine[20::10])
    total = sum(np.asarray(energy) for energy in lobes.energy) + np.asarray(lobes.remainder)
    np.testing.assert_allclose(found.rows[0, 20::10, :, :3].sum(axis=1).T, total, atol=5e-3)
