"""Coupling and decoupling of components by their receptances (frequency-based substructuring).

Sources: D. de Klerk, D. J. Rixen and S. N. Voormeeren, "General framework for dynamic
substructuring", AIAA Journal 46 (2008) 1169, for the dual and the primal form; W. D'Ambrogio and
A. Fregolent, Mechanical Systems and Signal Processing 24 (2010) 2035, for decoupling with an
extended interface; F. Trainotti et al., Mechanical Systems and Signal Processing 163 (2022), for
interfaces that are reduced by singular vectors.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealOrComplexArray, checked, checked_array
from deboom.errors import InputError

SINGULAR = 1e12
"""Condition number of an interface, each degree of freedom scaled, above which it is refused."""


@checked(outputs="o distinct", inputs="i distinct", receptance="f o i")
class Component:
    """A body that moves on its own: its responses to unit forces.

    - `outputs` (n_output,), `inputs` (n_input,): names of the degrees of freedom that are measured
      and excited. A degree of freedom at which the body is joined stands in both.
    - `receptance` (n_frequency, n_output, n_input): response per force or moment [m/N, rad/N, m/(N
      m), rad/(N m)]. Outputs may be of another kind, such as a pressure [Pa/N], unless they are
      joined.

    See Also
    --------
    deboom.physics.substructuring.Joint, deboom.physics.substructuring.couple
    deboom.physics.substructuring.decouple
    """

    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    receptance: ComplexArray


@checked(first="j some distinct", second="j some distinct")
class Joint:
    """Degrees of freedom of two bodies that move together, or with a mount between them.

    - `first`, `second` (n_joint,): names of the degrees of freedom, pair by pair; both count in the
      same direction.
    - `compliance` (n_frequency or 1, n_joint, n_joint): inverse of the dynamic stiffness of a
      massless mount between them [m/N and so on]; None for a rigid joint.
    - `compatibility` (n_frequency or 1, n_condition, n_joint): combinations of the gaps that are
      closed, such as the inverse of a virtual point's forward matrix; None for every gap.
    - `equilibrium` (n_frequency or 1, n_joint, n_force): the patterns of force by which they are
      closed, such as a forward matrix; None for a force in each pair.

    With fewer conditions than pairs the gaps close in the mean only, as many channels on a rigid
    interface demand. ``n_force = n_condition``, unless there are more conditions than forces, which
    are then met in the sense of least squares.

    See Also
    --------
    deboom.physics.substructuring.Component, deboom.physics.substructuring.couple
    deboom.physics.substructuring.decouple, deboom.physics.substructuring.assembled_stiffness
    """

    first: tuple[str, ...]
    second: tuple[str, ...]
    compliance: ComplexArray | None = None
    compatibility: RealOrComplexArray | None = None
    equilibrium: RealOrComplexArray | None = None

    def __post_init__(self) -> None:
        n_joint = len(self.first)
        for name, axes in {
            "compliance": f"f {n_joint} {n_joint}",
            "compatibility": f"f c {n_joint}",
            "equilibrium": f"f {n_joint} e",
        }.items():
            value = getattr(self, name)
            if value is not None:
                array = checked_array(value, axes, f"joint: {name}", dtype=complex)
                object.__setattr__(self, name, array)


def couple(components: Sequence[Component], joints: Sequence[Joint]) -> Component:
    """Join components by their receptances: the dual form of substructuring.

    Parameters
    ----------
    components : sequence of Component
        Bodies on their own, on the same lines; no two have an output, or an input, of one name.
    joints : sequence of Joint
        What is joined. A joint may also close a loop within one component.

    Returns
    -------
    Component
        The assembly, with all outputs and inputs of its components. Joined pairs move alike where
        the joint is rigid and complete.

    Raises
    ------
    InputError
        Unlike lines, doubled names, a joint at a degree of freedom that no component measures and
        excites, or an interface whose conditions depend on each other.

    See Also
    --------
    deboom.physics.substructuring.decouple, deboom.physics.substructuring.assembled_stiffness
    deboom.physics.substructuring.Component, deboom.physics.substructuring.Joint

    Notes
    -----
    ``Y_AB = Y − Y Gᵀ (B Y Gᵀ + C)⁻¹ B Y`` with Y block diagonal, B the signed matrix of
    compatibility, Gᵀ that of equilibrium, C the compliance in the joints (de Klerk et al. 2008, who
    have ``G = B`` and ``C = 0``). Only the receptances at the interface are inverted, so that
    responses and loads elsewhere need not be complete. Errors of measurement grow with the
    condition number of the interface, which is large near resonances of the assembly.

    Examples
    --------
    A mass of 2 kg and one of 3 kg, joined rigidly, are a mass of 5 kg:

    >>> import numpy as np
    >>> squared = (2 * np.pi * np.array([10.0, 20.0])) ** 2
    >>> light = Component(["a"], ["a"], -1 / (2.0 * squared)[:, None, None])
    >>> heavy = Component(["b"], ["b"], -1 / (3.0 * squared)[:, None, None])
    >>> assembly = couple([light, heavy], [Joint(["a"], ["b"])])
    >>> np.allclose(assembly.receptance[:, 0, 0], -1 / (5.0 * squared))
    True
    """
    whole = _side_by_side(components)
    if not joints:
        return whole
    compatibility = [_signed_rows(joint, whole.outputs, "outputs") for joint in joints]
    equilibrium = [_signed_rows(joint, whole.inputs, "inputs") for joint in joints]
    for index, joint in enumerate(joints):
        if joint.compatibility is not None:
            compatibility[index] = joint.compatibility @ compatibility[index]
        if joint.equilibrium is not None:
            equilibrium[index] = np.swapaxes(joint.equilibrium, 1, 2) @ equilibrium[index]
    n_lines = len(whole.receptance)
    closing = _stacked(compatibility, n_lines)
    pushing = np.swapaxes(_stacked(equilibrium, n_lines), 1, 2)
    interface = closing @ whole.receptance @ pushing + _compliances(joints, n_lines)
    gap = closing @ whole.receptance
    force = _solved(interface, gap)
    return Component(
        whole.outputs, whole.inputs, whole.receptance - whole.receptance @ pushing @ force
    )


def decouple(assembly: Component, removed: Component, shared: Sequence[str]) -> Component:
    """Take a component out of an assembly that was measured together with it.

    Parameters
    ----------
    assembly : Component
        The assembly, with the names of the removed component at the shared degrees of freedom.
    removed : Component
        The component that is taken out, measured or modelled on its own.
    shared : sequence of str
        Degrees of freedom known of both: those of the interface, and any inside the removed
        component (an extended interface), which make the result less sensitive to noise.

    Returns
    -------
    Component
        What is left, with the outputs and inputs of the assembly. Those inside the removed
        component are no longer part of a body: select the others.

    Raises
    ------
    InputError
        Unlike lines, or a shared degree of freedom that one of both lacks.

    See Also
    --------
    deboom.physics.substructuring.couple, deboom.physics.substructuring.Component
    deboom.physics.substructuring.Joint

    Notes
    -----
    ``Y_B = Y_AB − Y_AB,:s (Y_AB,ss − Y_A,ss)⁺ Y_AB,s:``: the negative of the component is joined.
    The difference has the rank of the true interface; singular values below the relative
    rounding of double precision, each degree of freedom scaled, are left out (D'Ambrogio and
    Fregolent 2010). With measured functions the noise fills the rest: bring no more shared degrees
    of freedom than the quality of both measurements supports.

    Examples
    --------
    A mass of 5 kg without 2 kg of it is a mass of 3 kg:

    >>> import numpy as np
    >>> squared = (2 * np.pi * np.array([10.0, 20.0])) ** 2
    >>> both = Component(["a"], ["a"], -1 / (5.0 * squared)[:, None, None])
    >>> light = Component(["a"], ["a"], -1 / (2.0 * squared)[:, None, None])
    >>> rest = decouple(both, light, ["a"])
    >>> np.allclose(rest.receptance[:, 0, 0], -1 / (3.0 * squared))
    True
    """
    for name in shared:
        for body, title in ((assembly, "assembly"), (removed, "removed component")):
            if name not in body.outputs or name not in body.inputs:
                raise InputError(
                    f"{name} is shared, but the {title} does not have it as output and input"
                )
    if len(assembly.receptance) != len(removed.receptance):
        raise InputError(
            f"the assembly has {len(assembly.receptance)} lines and the removed component "
            f"{len(removed.receptance)}: bring both on the same lines"
        )
    rows = [assembly.outputs.index(name) for name in shared]
    columns = [assembly.inputs.index(name) for name in shared]
    at_removed = removed.receptance[:, [removed.outputs.index(name) for name in shared]]
    at_removed = at_removed[:, :, [removed.inputs.index(name) for name in shared]]
    to_shared = assembly.receptance[:, rows]
    from_shared = assembly.receptance[:, :, columns]
    interface = to_shared[:, :, columns] - at_removed
    scale = 1.0 / np.sqrt(np.abs(np.einsum("fii->fi", at_removed)).mean(axis=0))
    scaled = interface * np.outer(scale, scale)
    inverse = np.linalg.pinv(scaled, rcond=1.0 / SINGULAR) * np.outer(scale, scale)
    return Component(
        assembly.outputs,
        assembly.inputs,
        assembly.receptance - from_shared @ inverse @ to_shared,
    )


def assembled_stiffness(
    stiffness: Sequence[npt.ArrayLike], names: Sequence[Sequence[str]]
) -> tuple[tuple[str, ...], ComplexArray]:
    """Join components by their dynamic stiffness matrices: the primal form of substructuring.

    Parameters
    ----------
    stiffness : sequence of array_like, shape (n_frequency, n, n)
        Complete dynamic stiffness matrices, of models or of inverted receptances [N/m and so on]. A
        mount is a component as well: ``[[K, −K], [−K, K]]``.
    names : sequence of sequences of str
        Degrees of freedom of each matrix; equal names are joined rigidly.

    Returns
    -------
    names : tuple of str
        All degrees of freedom, in the order in which they first stand.
    stiffness : array, shape (n_frequency, n_all, n_all)
        ``Lᵀ Z L`` of the assembly (de Klerk et al. 2008); its inverse is the receptance that
        `couple` gives.

    Raises
    ------
    InputError
        Another number of names than of degrees of freedom, or unlike lines.

    See Also
    --------
    deboom.physics.substructuring.couple, deboom.physics.substructuring.Joint
    deboom.dynamic_centre_of_stiffness

    Examples
    --------
    Masses of 2 and 3 kg at both ends of a spring of 1000 N/m, at rest and at 1 rad/s:

    >>> import numpy as np
    >>> squared = np.array([0.0, 1.0])[:, None, None]
    >>> spring = [1000.0 * np.array([[1, -1], [-1, 1]])] * 2
    >>> names, stiffness = assembled_stiffness(
    ...     [-2.0 * squared, -3.0 * squared, spring], [["a"], ["b"], ["a", "b"]]
    ... )
    >>> names, stiffness[1].real.tolist()
    (('a', 'b'), [[998.0, -1000.0], [-1000.0, 997.0]])
    """
    if len(stiffness) != len(names) or not names:
        raise InputError("give as many lists of names as matrices, at least one of each")
    sizes: dict[str, int] = {}
    matrices = [
        checked_array(
            matrix, f"f {len(labels)} {len(labels)}", f"stiffness {i + 1}", sizes, complex
        )
        for i, (matrix, labels) in enumerate(zip(stiffness, names, strict=True))
    ]
    every = tuple(dict.fromkeys(name for labels in names for name in labels))
    total = np.zeros((len(matrices[0]), len(every), len(every)), complex)
    for matrix, labels in zip(matrices, names, strict=True):
        places = [every.index(name) for name in labels]
        total[:, np.asarray(places)[:, np.newaxis], places] += matrix
    return every, total


def singular_vectors(
    receptance: npt.ArrayLike, n_vectors: int
) -> tuple[ComplexArray, ComplexArray]:
    """Return the strongest patterns of motion and force at an interface, line by line.

    Parameters
    ----------
    receptance : array_like, shape (n_frequency, n_joint, n_joint)
        Receptance of one component at its interface, in one unit or scaled.
    n_vectors : int
        Patterns that are kept, at least 1: the rank of the interface, 6 where it is rigid.

    Returns
    -------
    compatibility : array, shape (n_frequency, n_vectors, n_joint)
        ``Uᴴ``, for `Joint.compatibility`.
    equilibrium : array, shape (n_frequency, n_joint, n_vectors)
        ``V``, for `Joint.equilibrium`.

    Raises
    ------
    InputError
        More patterns than the interface has degrees of freedom.

    See Also
    --------
    deboom.physics.substructuring.couple, deboom.virtual_point

    Notes
    -----
    ``Y = U S Vᴴ``; the joint then holds along the first singular vectors only, which carry the
    motion above the noise (Trainotti et al. 2022). A rank-deficient interface, such as nine
    channels on a rigid block, cannot be coupled otherwise. Both components are reduced by the same
    vectors.

    Examples
    --------
    Three channels on a rigid body that moves along one axis have one pattern:

    >>> import numpy as np
    >>> compatibility, equilibrium = singular_vectors(np.ones((1, 3, 3)), 1)
    >>> np.abs(compatibility[0, 0]).round(2).tolist()
    [0.58, 0.58, 0.58]
    """
    matrix = checked_array(receptance, "f j j", "receptance at the interface", dtype=complex)
    if not 1 <= n_vectors <= matrix.shape[1]:
        raise InputError(
            f"an interface of {matrix.shape[1]} degrees of freedom has no {n_vectors} singular "
            "vectors"
        )
    left, _, right = np.linalg.svd(matrix)
    return (
        np.swapaxes(left[:, :, :n_vectors], 1, 2).conj(),
        np.swapaxes(right[:, :n_vectors], 1, 2).conj(),
    )


def _side_by_side(components: Sequence[Component]) -> Component:
    """Return all components as one that is not joined: a block diagonal receptance."""
    if not components:
        raise InputError("there is nothing to couple: give at least one component")
    lines = sorted({len(component.receptance) for component in components})
    if len(lines) > 1:
        raise InputError(f"components have {lines} lines: bring them on the same lines")
    outputs = [name for component in components for name in component.outputs]
    inputs = [name for component in components for name in component.inputs]
    for kind, names in (("output", outputs), ("input", inputs)):
        if doubled := sorted({name for name in names if names.count(name) > 1}):
            raise InputError(
                f"several components have the {kind}s {doubled}: name them apart, such as "
                f"'body {doubled[0]}'"
            )
    receptance = np.zeros((lines[0], len(outputs), len(inputs)), complex)
    row = column = 0
    for component in components:
        _, n_output, n_input = component.receptance.shape
        receptance[:, row : row + n_output, column : column + n_input] = component.receptance
        row, column = row + n_output, column + n_input
    return Component(tuple(outputs), tuple(inputs), receptance)


def _signed_rows(joint: Joint, names: tuple[str, ...], kind: str) -> ComplexArray:
    """Return the gap of each pair, first minus second, shape (1, n_joint, n_names)."""
    rows = np.zeros((1, len(joint.first), len(names)), complex)
    for sign, side in ((1.0, joint.first), (-1.0, joint.second)):
        if missing := sorted(set(side) - set(names)):
            raise InputError(f"a joint names {missing}, which are no {kind} of a component")
        rows[0, np.arange(len(side)), [names.index(name) for name in side]] += sign
    return rows


def _stacked(rows: Sequence[RealOrComplexArray], n_lines: int) -> ComplexArray:
    """Return conditions of all joints below each other, shape (n_frequency, n_condition, n)."""
    for block in rows:
        if len(block) not in (1, n_lines):
            raise InputError(
                f"a joint has {len(block)} lines and the components {n_lines}: bring them on the "
                "same lines"
            )
    return np.concatenate(
        [np.broadcast_to(block, (n_lines, *block.shape[1:])) for block in rows], axis=1
    )


def _compliances(joints: Sequence[Joint], n_lines: int) -> ComplexArray:
    """Return the compliance of all joints, block diagonal, conditions by forces."""
    blocks = []
    for joint in joints:
        n_joint = len(joint.first)
        block = np.zeros((1, n_joint, n_joint), complex)
        if joint.compliance is not None:
            block = joint.compliance
        if joint.compatibility is not None:
            block = joint.compatibility @ block
        if joint.equilibrium is not None:
            block = block @ joint.equilibrium
        if len(block) not in (1, n_lines):
            raise InputError(
                f"a joint has {len(block)} lines and the components {n_lines}: bring them on the "
                "same lines"
            )
        blocks.append(block)
    shape = np.sum([block.shape[1:] for block in blocks], axis=0)
    whole = np.zeros((n_lines, *shape), complex)
    row = column = 0
    for block in blocks:
        n_condition, n_force = block.shape[1:]
        whole[:, row : row + n_condition, column : column + n_force] = block
        row, column = row + n_condition, column + n_force
    return whole


def _solved(interface: ComplexArray, gap: ComplexArray) -> ComplexArray:
    """Return the forces that close the gaps, in the mean square where there are more gaps."""
    rows = np.abs(interface).max(axis=(0, 2))
    columns = np.abs(interface).max(axis=(0, 1))
    if np.any(rows == 0.0) or np.any(columns == 0.0):
        raise InputError("nothing moves at a joint: leave out the pair that has no receptance")
    # scaled, because metres and radians stand side by side
    scaled = interface / np.sqrt(rows[:, np.newaxis] * columns)
    singular = np.linalg.svd(scaled, compute_uv=False)
    if interface.shape[1] < interface.shape[2]:
        raise InputError(
            f"the joints have {interface.shape[2]} forces for {interface.shape[1]} conditions: "
            "give at least as many conditions as forces"
        )
    if np.any(singular[:, -1] * SINGULAR <= singular[:, 0]):
        raise InputError(
            "the conditions of the joints depend on each other, as many channels on a rigid "
            "interface do: reduce them by a virtual point or by singular vectors"
        )
    return np.asarray(np.linalg.pinv(interface) @ gap)
