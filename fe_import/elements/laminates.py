"""Stiffness of the thickness of a shell: layers of isotropic or orthotropic material, from the bottom to the top.

First-order theory (R. M. Jones, Mechanics of Composite Materials, 2nd ed. 1999, ch. 4): membrane forces N = A ε + B κ,
moments M = B ε + D κ, shear forces Q = k H γ, with A, B, D = Σ ∫ Q̄ (1, z, z²) dz and H = Σ G t; the shear correction k
is 5/6, exact where all layers are alike.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fe_import.model import Array

SHEAR_CORRECTION = 5 / 6


_SAME = 1e-9


@dataclass(frozen=True)
class Lamina:
    """A layer.

    Attributes
    ----------
    plane : (3, 3) array
        Stress 11, 22, 12 per strain 11, 22, twice 12, without stress across, in its own axes [Pa].
    shear : (2,) array
        Shear moduli G13, G23 [Pa].
    density, thickness : float
    angle : float
        From the first axis of the element to its own [rad], about the normal.
    """

    plane: Array
    shear: Array
    density: float
    thickness: float
    angle: float = 0.0

    @property
    def turned_plane(self) -> Array:
        """(3, 3) in the axes of the element."""
        c, s = np.cos(self.angle), np.sin(self.angle)
        strain = np.array([[c * c, s * s, c * s], [s * s, c * c, -c * s], [-2 * c * s, 2 * c * s, c * c - s * s]])
        return np.asarray(strain.T @ self.plane @ strain)

    @property
    def turned_shear(self) -> Array:
        """(2, 2) in the axes of the element."""
        turn = np.array([[np.cos(self.angle), np.sin(self.angle)], [-np.sin(self.angle), np.cos(self.angle)]])
        return np.asarray(turn.T @ np.diag(self.shear) @ turn)


@dataclass(frozen=True)
class Laminate:
    """Layers from the bottom, the middle of all of them ``offset`` above the nodes."""

    layers: tuple[Lamina, ...]
    offset: float = 0.0

    @property
    def thickness(self) -> float:
        """Of all layers."""
        return sum(layer.thickness for layer in self.layers)

    @property
    def heights(self) -> Array:
        """(layers + 1,) of the borders of the layers above the nodes."""
        borders = np.concatenate([[0.0], np.cumsum([layer.thickness for layer in self.layers])])
        return np.asarray(borders - borders[-1] / 2 + self.offset)

    @property
    def isotropic(self) -> bool:
        """Whether turning it about its normal changes nothing."""
        for layer in self.layers:
            one, other = layer.turned_plane, replace(layer, angle=layer.angle + 0.5).turned_plane
            if np.abs(one - other).max() > 1e-12 * np.abs(one).max() or layer.shear[0] != layer.shear[1]:
                return False
        return True

    @property
    def sided(self) -> bool:
        """Whether it matters which side is its top: turned over, layers come in reverse order and angles turn back."""
        over = Laminate(tuple(replace(layer, angle=-layer.angle) for layer in self.layers[::-1]), -self.offset)
        stiffness, moments = self.stiffness(), self.moments()
        size = np.sqrt(np.diag(stiffness))
        bends = np.abs(over.stiffness() - stiffness) > _SAME * np.outer(size, size)
        return bool(bends.any() or abs(over.moments()[1] - moments[1]) > _SAME * moments[0] * self.thickness)

    def stiffness(self) -> Array:
        """(8, 8) [N/m, N, N m], see `fe_import.elements.shell_strains`; about the nodes."""
        result, heights = np.zeros((8, 8)), self.heights
        for layer, low, high in zip(self.layers, heights[:-1], heights[1:], strict=True):
            plane = layer.turned_plane
            result[:3, :3] += plane * (high - low)
            result[:3, 3:6] += plane * (high**2 - low**2) / 2
            result[3:6, 3:6] += plane * (high**3 - low**3) / 3
            result[6:, 6:] += SHEAR_CORRECTION * layer.turned_shear * (high - low)
        result[3:6, :3] = result[:3, 3:6].T
        return (result + result.T) / 2

    def surfaces(self) -> Array:
        """(3, 5, 8) stress 11, 22, 12, 13, 23 by the strains of the section, at bottom, middle and top.

        Shear across is that of a parabola where there is one layer, 3/2 of its mean in the middle and none outside; of
        several the mean.
        """
        heights, layers = self.heights, self.layers
        middle = (heights[0] + heights[-1]) / 2
        inside = min(int(np.searchsorted(heights, middle, side="right")) - 1, len(layers) - 1)
        shares = (0.0, 1.5, 0.0) if len(layers) == 1 else (1.0, 1.0, 1.0)
        result = np.zeros((3, 5, 8))
        for k, (layer, height) in enumerate(zip((0, inside, -1), (heights[0], middle, heights[-1]), strict=True)):
            plane = layers[layer].turned_plane
            result[k, :3, :3], result[k, :3, 3:6] = plane, height * plane
            result[k, 3:, 6:] = shares[k] * SHEAR_CORRECTION * layers[layer].turned_shear
        return result

    def moments(self) -> Array:
        """(3,) ∫ρ dz, ∫ρ z dz, ∫ρ z² dz."""
        result, heights = np.zeros(3), self.heights
        for layer, low, high in zip(self.layers, heights[:-1], heights[1:], strict=True):
            result += layer.density * np.array([high - low, (high**2 - low**2) / 2, (high**3 - low**3) / 3])
        return result


def plane_stress(first: float, second: float, ratio: float, shear: float) -> Array:
    """(3, 3) plane-stress moduli of E1, E2, ν12 and G12.

    Raises
    ------
    ValueError
        Constants that no elastic material has.
    """
    if not (min(first, second, shear) > 0 and ratio**2 < first / second):
        raise ValueError("moduli must be positive, and the square of Poisson's ratio below E1 / E2")
    scale = 1 / (1 - ratio**2 * second / first)
    return np.array(
        [[scale * first, scale * ratio * second, 0.0], [scale * ratio * second, scale * second, 0.0], [0.0, 0.0, shear]]
    )
