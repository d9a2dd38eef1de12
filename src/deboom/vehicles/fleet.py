"""Vehicles, and what each mount contributes to the pressure in each of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np
from threadpoolctl import ThreadpoolController

from deboom.arrays import AXES, BoolArray, ComplexArray, IntArray, RealArray, checked, short_repr
from deboom.errors import InputError
from deboom.measurement.channels import Band, Frf, LoadCase, Spectrum, lines_inside, refuse_doubled
from deboom.mounts.mount import Mount, in_mount_axes, in_vehicle_axes
from deboom.physics import transfer_path
from deboom.physics.dynamic_stiffness import dynamic_stiffness
from deboom.vehicles.receivers import EAR, Receiver

LOSS_SUFFIX = " loss"
"""What the name of a loss factor adds to that of its stiffness factor."""

ROWS = 64
"""Designs per matrix product. Constant, with padding: BLAS takes other instructions for other
shapes, and the result of a design must not depend on the designs that come with it."""


@dataclass(frozen=True, eq=False)
class Vehicle:
    """A body with its noise transfer functions to one ear, and to further receivers.

    - `name`: name, such as ``U06-1``.
    - `group`: body variant or series, such as ``U06``.
    - `noise_transfer`: one output, the ear; one input per path, ``<mount> <axis>``, or
      ``<mount> <piece> <axis>`` for every piece [Pa/N].
    - `receptance`, optional: displacement of the trimmed body at every path per force at every
      path, with the paths as outputs and inputs; the body of None stays at rest [m/N]. Functions
      between different paths that are all 0 are not known: `has_driving_points_alone`.
    - `ear`: weight and target of that ear, whose response has the vehicle's name.
    - `receivers`: further ears and vibrating points, each with its functions from the same paths
      [`Receiver.transfer_unit`].
    - raises InputError: another unit than Pa/N, or not exactly one output; a receptance of other
      paths or another unit, that is not reciprocal, or that would give energy; receivers of one
      name, or with functions of another unit or to several outputs.
    """

    name: str
    group: str
    noise_transfer: Frf
    receptance: Frf | None = None
    ear: Receiver = EAR
    receivers: Mapping[Receiver, Frf] = field(default_factory=dict)

    __repr__ = short_repr

    def __post_init__(self) -> None:
        if self.noise_transfer.unit != "Pa/N":
            raise InputError(
                f"vehicle {self.name}: noise transfer functions are in "
                f"{self.noise_transfer.unit}, convert them to Pa/N"
            )
        if len(self.noise_transfer.outputs) != 1:
            raise InputError(
                f"vehicle {self.name}: noise transfer functions to "
                f"{list(self.noise_transfer.outputs)}: select() the one ear that counts"
            )
        if self.receptance is not None:
            _check_receptance(self.name, self.receptance, self.noise_transfer.inputs)
        refuse_doubled([each.name for each in self.transfers], f"receiver of {self.name}")
        for receiver, frf in self.receivers.items():
            owner = f"vehicle {self.name}: receiver '{receiver.name}'"
            if frf.unit != receiver.transfer_unit:
                raise InputError(
                    f"{owner} is of {receiver.quantity}, and its functions are in {frf.unit}: "
                    f"convert them to {receiver.transfer_unit}"
                )
            if len(frf.outputs) != 1:
                raise InputError(
                    f"{owner} has functions to {list(frf.outputs)}: select() the one that counts"
                )

    @property
    def transfers(self) -> dict[Receiver, Frf]:
        """Functions to every receiver, the ear of `noise_transfer` first."""
        return {self.ear: self.noise_transfer, **self.receivers}

    def heard(self, *, by_driver: bool = False) -> Vehicle:
        """Return the same vehicle without receivers that vibrate, or with its own ear alone."""
        kept = {r: frf for r, frf in self.receivers.items() if r.is_sound and not by_driver}
        return self if len(kept) == len(self.receivers) else replace(self, receivers=kept)

    @property
    def has_driving_points_alone(self) -> bool:
        """Tell whether of the body nothing is known between different paths.

        In coupled motion each point of such a body gives way to the force on itself alone.
        """
        if self.receptance is None:
            return False
        paths = self.receptance.inputs
        values = self.receptance.select(outputs=paths).values
        return len(paths) > 1 and not np.any(values[:, ~np.eye(len(paths), dtype=bool)])


NOT_RECIPROCAL = 0.5
"""Largest difference of a receptance from its transpose, over its size, that is noise [1]: 20 % of
noise in every function leave 0.28."""

NOT_PASSIVE = 0.05
"""Largest power that a receptance gives, over the size of its functions, beyond the relative noise
of these [1]: on stiff brackets noise gives up to 0.8 times that."""

UNLIKE = -0.5
"""Likeness of what must be alike from which on it is opposite [1]; noise alone leaves about 0."""

LIKELY = 0.8
"""Likeness of what must be alike from which on a fault is named [1]: 20 % of noise leave 0.95."""

OTHER_SIZE = 10.0
"""Ratio of the sizes of two functions that must be alike from which on one is no receptance [1]."""

FLAT = 0.9
"""Mean of a real part over its root mean square from which on it is that of a spring [1]; a mass
has 0.76 over two octaves."""

OTHER_DRIVING_POINT = 1e4
"""The same of driving points, whose sizes differ more [1]."""

FEWEST_LINES = 10
"""Lines from which on a single function is judged."""


def _check_receptance(vehicle: str, receptance: Frf, paths: Sequence[str]) -> None:
    """Refuse what cannot be the receptance of a body at the paths."""
    owner = f"vehicle {vehicle}: its receptance"
    if receptance.unit != "m/N":
        raise InputError(f"{owner} is in {receptance.unit}, convert it to m/N")
    for names, what in ((receptance.outputs, "responses"), (receptance.inputs, "forces")):
        if set(names) != set(paths):
            raise InputError(
                f"{owner} has {what} at {list(names)}, the noise transfer functions are those of "
                f"{list(paths)}: measure the body at the same paths"
            )
    values = receptance.select(outputs=paths, inputs=paths).values
    sizes = np.linalg.norm(values.diagonal(axis1=1, axis2=2), axis=0)
    ratio = sizes / max(float(np.median(sizes)), _TINY)
    if not np.all((ratio < OTHER_DRIVING_POINT) & (ratio > 1.0 / OTHER_DRIVING_POINT)):
        odd = int(np.argmax(np.abs(np.log(np.maximum(ratio, _TINY)))))
        raise InputError(
            f"{owner} at {paths[odd]} per force there is {ratio[odd]:.3g} times that of the other "
            "paths: check its unit, and that it is displacement per force"
        )
    loss = -values.imag.diagonal(axis1=1, axis2=2)
    # squares weigh the resonances, where losses stand out of the noise
    taken = (loss * np.abs(loss)).sum(axis=0) / np.maximum((loss**2).sum(axis=0), _TINY)
    # a flat negative real part is a negative stiffness; that of a mass falls with the frequency
    real = values.real.diagonal(axis1=1, axis2=2)
    size = np.linalg.norm(real, axis=0) * np.sqrt(len(real))
    flat = real.sum(axis=0) / np.maximum(size, _TINY)
    taken = np.where((len(real) >= FEWEST_LINES) & (flat < -FLAT), -1.0, taken)
    if np.any(taken < UNLIKE):
        raise InputError(
            f"{owner} gives energy at {paths[int(np.argmin(taken))]}: check the sign of its "
            "motion, that it is displacement per force, and that it has the factor e^(+jωt)"
        )
    if fault := _fault_of_pairs(values, paths):
        raise InputError(
            f"{owner} {fault}, and a body answers alike with force and response exchanged: check "
            "both"
        )
    asymmetry = np.linalg.norm(values - values.swapaxes(1, 2)) / np.linalg.norm(values)
    if not asymmetry <= NOT_RECIPROCAL:
        raise InputError(
            f"{owner} differs from its transpose by {100 * asymmetry:.0f} % of its size, and a "
            "body answers alike with force and response exchanged: check directions, signs and "
            "the order of channels"
        )
    if not np.any(values[:, ~np.eye(len(paths), dtype=bool)]):
        return  # driving points alone, each of which was judged
    symmetric = (values + values.swapaxes(1, 2)) / 2.0
    power = np.linalg.eigvalsh(-symmetric.imag)
    given = -power[power < 0.0].sum() / np.linalg.norm(values, axis=(1, 2)).sum()
    if given > NOT_PASSIVE + relative_noise(values):
        raise InputError(
            f"{owner} gives energy, {100 * given:.0f} % of the size of its functions, and a body "
            "only takes: check directions and signs of its channels"
        )


_TINY = float(np.finfo(float).tiny)


def relative_noise(receptance: ComplexArray) -> float:
    """Estimate the noise of each function of a receptance from what is not reciprocal.

    - `receptance` (f, n, n) [m/N].
    - returns root mean square of the complex error over the function [1]; 0 of one path.

    The squared difference of two measured functions, over their size, is exponentially distributed;
    its median stands resonances of different days.
    """
    row, column = np.triu_indices(receptance.shape[1], 1)
    first, second = receptance[:, row, column], receptance[:, column, row]
    if not row.size:
        return 0.0
    size = np.maximum(np.abs(first * second), _TINY)
    return float(np.sqrt(np.median(np.abs(first - second) ** 2 / size) / (2.0 * np.log(2.0))))


def _fault_of_pairs(values: ComplexArray, paths: Sequence[str]) -> str:
    """Name two functions that must be alike and how one is wrong; empty where noise explains it."""
    if len(values) < FEWEST_LINES:
        return ""
    rows, columns = np.triu_indices(len(paths), 1)
    first, second = values[:, rows, columns], values[:, columns, rows]

    def likeness(one: ComplexArray | RealArray, other: ComplexArray | RealArray) -> RealArray:
        product = np.linalg.norm(one, axis=0) * np.linalg.norm(other, axis=0)
        return np.asarray(np.sum(one.conj() * other, axis=0).real / np.maximum(product, _TINY))

    sizes = np.sort([np.linalg.norm(first, axis=0), np.linalg.norm(second, axis=0)], axis=0)
    opposite_losses = likeness(first.imag, second.imag) < UNLIKE
    faults = {
        "has another size than": sizes[1] > OTHER_SIZE * sizes[0],
        "has the other sign of": likeness(first, -second) > LIKELY,
        "is the complex conjugate of": (likeness(first, second.conj()) > LIKELY) & opposite_losses,
    }
    for words, wrong in faults.items():
        if wrong.any():
            at = int(np.argmax(wrong))
            one, other = paths[rows[at]], paths[columns[at]]
            return f"at {one} per force at {other} {words} that at {other} per force at {one}"
    return ""


@checked(vehicles="some distinct")
class Fleet:
    """The population that one mount design has to serve.

    - `vehicles`: at least one vehicle, each with a name of its own.
    - raises InputError: no vehicle, or a doubled name.
    """

    vehicles: tuple[Vehicle, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Name of each vehicle."""
        return tuple(vehicle.name for vehicle in self.vehicles)

    @property
    def receivers(self) -> tuple[Receiver, ...]:
        """Receiver of each response: those of the first vehicle, then those of the next."""
        return tuple(receiver for vehicle in self.vehicles for receiver in vehicle.transfers)

    @property
    def response_names(self) -> tuple[str, ...]:
        """Name of each response, that of its vehicle or such as ``U06-1, seat rail z``."""
        return tuple(
            receiver.response_name(vehicle.name)
            for vehicle in self.vehicles
            for receiver in vehicle.transfers
        )

    @property
    def vehicle_of(self) -> tuple[int, ...]:
        """Number of the vehicle of each response."""
        return tuple(
            number for number, vehicle in enumerate(self.vehicles) for _ in vehicle.transfers
        )

    def group(self, *names: str) -> Fleet:
        """Return the vehicles of one group or several, in the fleet's order.

        - raises InputError: no vehicle of a group.
        """
        groups = sorted({vehicle.group for vehicle in self.vehicles})
        for name in names:
            if name not in groups:
                raise InputError(
                    f"no vehicle of group {name!r} in the fleet: choose one of {groups}"
                )
        return Fleet(tuple(vehicle for vehicle in self.vehicles if vehicle.group in names))


@checked(frequency="f", values="v f k", vehicle_names="v", variable_names="k")
class PathContributions:
    """Complex pressure at the ears per unit stiffness factor, with the motion prescribed.

    - `load_case`: name of the load case whose motion it is.
    - `frequency` (f,): lines of the band [Hz].
    - `values` (v, f, k): pressure per design variable; exactly zero where an axis does not
      transmit [Pa].
    - `vehicle_names`, `variable_names`: names of the first and of the last axis: responses, each of
      a receiver in a vehicle, and design variables.

    The pressure of a design x is ``p_vf = Σ_k C_vfk x_k`` with the values C: thesis, eq. 12 and 13.
    """

    load_case: str
    frequency: RealArray
    values: ComplexArray
    vehicle_names: tuple[str, ...]
    variable_names: tuple[str, ...]

    @property
    def transmits(self) -> BoolArray:
        """Lines at which any path reaches the ear, shape (v, f)."""
        return np.asarray(self.values.any(axis=2))

    def pressure(self, designs: RealArray) -> ComplexArray:
        """Return the pressure at the ears for designs (n, k).

        - returns (n, v, f): complex peak amplitudes [Pa]. The rows of a design depend on it alone,
          bit for bit.
        """
        table = self.values.reshape(-1, self.values.shape[2]).T
        real, imag = np.ascontiguousarray(table.real), np.ascontiguousarray(table.imag)
        pressure = np.empty((len(designs), real.shape[1]), dtype=complex)
        with _blas().limit(limits=1, user_api="blas"), np.errstate(all="ignore"):
            for first in range(0, len(designs), ROWS):
                rows = designs[first : first + ROWS]
                padded = np.zeros((ROWS, designs.shape[1]))
                padded[: len(rows)] = rows
                block = pressure[first : first + ROWS]
                block.real = (padded @ real)[: len(rows)]
                block.imag = (padded @ imag)[: len(rows)]
        return pressure.reshape(len(designs), *self.values.shape[:2])

    def neper_gradient(self, designs: RealArray) -> RealArray:
        """Return ``Σ_f Re(∂p/∂x_k / p)`` for designs (n, k), shape (n, v, k) [1]."""
        return self.weighted_gradient(designs, 1.0 / self.pressure(designs))

    def weighted_gradient(self, designs: RealArray, factor: ComplexArray) -> RealArray:
        """Return ``Σ_f Re(a_f ∂p/∂x_k)`` with factors a (n, v, f) [1/Pa], shape (n, v, k) [1]."""
        _ = designs  # the pressure is linear: its derivative is the same at every design
        return np.asarray(np.einsum("vfk,dvf->dvk", self.values, factor).real)

    def at_lines(self, lines: IntArray) -> PathContributions:
        """Return the contributions of some lines only."""
        return replace(self, frequency=self.frequency[lines], values=self.values[:, lines])

    def with_parts(self, others: Sequence[PathContributions], part: IntArray) -> PathContributions:
        """Return the contributions with other parts: variable k from ``others[part[k]]``."""
        stacked = np.stack([other.values for other in others])
        values = stacked[part, :, :, np.arange(part.size)]
        return replace(self, values=np.moveaxis(values, 0, -1))


def paths_into(
    mounts: Sequence[Mount], inputs: Sequence[str] = ()
) -> dict[str, tuple[str, tuple[str, ...]]]:
    """Return each path with its design variable and the channels whose forces it takes.

    - `inputs`: of the noise transfer functions. Where they name every piece of a mount, each piece
      is a path; else the mount is one, with the sum of its forces, which is right only where these
      are equal or the pieces sound alike.
    - raises InputError: no path at all.
    """
    paths: dict[str, tuple[str, tuple[str, ...]]] = {}
    for mount in mounts:
        for axis, variable in zip(mount.transfer_axes, mount.paths, strict=True):
            channels = mount.channels(axis)
            if set(channels) <= set(inputs):
                paths |= {channel: (variable, (channel,)) for channel in channels}
            else:
                paths[variable] = variable, channels
    if not paths:
        raise InputError("no mount transmits anything: give transfer_axes to at least one")
    return paths


def path_forces(
    mounts: Sequence[Mount], load_case: LoadCase, inputs: Sequence[str] = ()
) -> Spectrum:
    """Return the force of each path on the body.

    - `mounts`: mounts whose transfer axes are the paths.
    - `load_case`: forces at the virtual point of each piece.
    - `inputs`: of the noise transfer functions, see `paths_into`.
    - returns: channels ``<mount> <axis>`` or those of the pieces, in the order of the mounts [N].
    - raises InputError: a mount of which a transfer axis was not measured, or no path at all.
    """
    paths = paths_into(mounts, inputs)
    force = load_case.force
    columns = []
    for variable, channels in paths.values():
        missing = [name for name in channels if name not in force.channels]
        if missing:
            raise InputError(
                f"load case {load_case.name}: no force of {missing} for mount "
                f"{variable.rpartition(' ')[0]}: measure these channels or take the axis out of "
                "transfer_axes"
            )
        columns.append(force.select(channels).values.sum(axis=1))
    return Spectrum(force.frequency, np.column_stack(columns), tuple(paths), force.unit)


def path_contributions(
    fleet: Fleet,
    mounts: Sequence[Mount],
    load_case: LoadCase,
    band: Band = (20.0, 60.0),
    *,
    loss_factors: bool = False,
) -> PathContributions:
    """Return what each stiffness factor contributes to the pressure in each vehicle.

    Parameters
    ----------
    fleet : Fleet
        Noise transfer functions of each vehicle.
    mounts : sequence of Mount
        Every mount has three design variables, one along each of its own axes.
    load_case : LoadCase
        Operating motion and force.
    band : (lower, upper)
        Both edges belong to the band [Hz].
    loss_factors : bool
        Split every force into its elastic part ``K' s`` and its lossy part ``j K'' s``: the columns
        of all elastic parts, then those of all lossy parts ``<mount> <axis> loss``.

    Raises
    ------
    InputError
        A band without lines; a path whose force was not measured, or any axis of a tilted mount;
        with loss factors a line without displacement; lines of a vehicle and of the load case that
        differ (nothing is interpolated); paths that a vehicle lacks, or has beyond those of the
        mounts.

    Notes
    -----
    ``C_vfk = Y_vf,path(k) F_f,path(k)`` with ``F = Σ_pieces K s``: thesis, eq. 12, 13 and 35, for
    one factor per mount and axis. The motion s is *prescribed*: it stays as measured while the
    factor x scales the stiffness, so the path's force is ``x K s = x f``, the measured force times
    the factor, whatever K and s are on their own. A factor k of a tilted mount, whose axes are the
    columns of R, scales ``F_k = Σ_b R_bk F_b``, which is heard as ``Σ_a Y_a R_ak F_k``.

    This is conservative in the gears 5 to 7, where
    the coupled powertrain answers with another motion and a 20 to 25 % larger effect; it is not
    valid below 30 Hz in low gears.
    """
    names = [variable for mount in mounts for variable in mount.variables]
    refuse_doubled(names, "design variable")
    if loss_factors:
        elastic, lossy = (
            path_contributions(fleet, mounts, part, band)
            for part in _split_forces(mounts, load_case)
        )
        values = np.concatenate([elastic.values, lossy.values], axis=2)
        return replace(elastic, values=values, variable_names=with_loss_names(names))
    inputs = fleet.vehicles[0].noise_transfer.inputs
    forces = path_forces(mounts, load_case, inputs)
    inside = lines_inside(forces.frequency, band, f"load case {load_case.name}")
    frequency = forces.frequency[inside]
    columns = [names.index(variable) for variable, _ in paths_into(mounts, inputs).values()]
    values = np.zeros((len(fleet.receivers), frequency.size, len(names)), dtype=complex)
    transfer = path_transfer(fleet, forces.channels, frequency, band, load_case.name)
    for ear, row in zip(transfer, values, strict=True):
        heard = transfer_path.contributions(ear, forces.values[inside])
        for column, path in zip(columns, heard.T, strict=True):
            row[:, column] += path
    if any(mount.tilted_pieces for mount in mounts):
        _turn_contributions(values, names, forces.channels, transfer, mounts, load_case, inside)
    return PathContributions(load_case.name, frequency, values, fleet.response_names, tuple(names))


def spring_transfer(
    mount: Mount, piece: int, axis: str, paths: Sequence[str], transfer: ComplexArray
) -> ComplexArray:
    """Return the pressure per force of one piece along one of its own axes.

    - `mount`, `piece`, `axis`: mount, number of its piece, and axis of the mount.
    - `paths`: names of the paths, see `paths_into`.
    - `transfer` (..., n_path): their noise transfer functions, along vehicle axes [Pa/N].
    - returns (...): ``Σ_a Y_a R_ak`` over the transfer axes; zero where none is met [Pa/N].
    """
    tilted = piece in mount.tilted_pieces
    share = mount.orientation(piece)[:, AXES.index(axis)]
    heard = np.zeros(transfer.shape[:-1], dtype=complex)
    for place, along in enumerate(AXES):
        if along in mount.transfer_axes and (tilted or along == axis):
            channel = mount.channels(along)[piece]
            name = channel if channel in paths else f"{mount.name} {along}"
            path = transfer[..., paths.index(name)]
            heard = heard + share[place] * path if tilted else path
    return heard


def _turn_contributions(
    values: ComplexArray,
    names: Sequence[str],
    paths: Sequence[str],
    transfer: ComplexArray,
    mounts: Sequence[Mount],
    load_case: LoadCase,
    inside: BoolArray,
) -> None:
    """Replace the contributions of tilted mounts, made of the force along their own axes."""
    force = in_mount_axes(mounts, load_case).force
    for mount in mounts:
        if not mount.tilted_pieces or not mount.transfer_axes:
            continue
        for axis, name in zip(AXES, mount.variables, strict=True):
            column = names.index(name)
            values[:, :, column] = 0.0
            for piece, channel in enumerate(mount.channels(axis)):
                if channel in force.channels:
                    along = force.select([channel]).values[inside, 0]
                    heard = spring_transfer(mount, piece, axis, paths, transfer)
                    values[:, :, column] += heard * along


def path_transfer(
    fleet: Fleet, paths: Sequence[str], frequency: RealArray, band: Band, load_case: str
) -> ComplexArray:
    """Return the functions to all receivers of a fleet on the lines of a load case.

    - `fleet`: each vehicle with exactly these paths.
    - `paths`: ``<mount> <axis>`` or ``<mount> <piece> <axis>``.
    - `frequency` (n_frequency,): lines of the load case inside the band [Hz].
    - `band` (lower, upper): both edges belong to the band [Hz].
    - `load_case`: name of the load case, for messages.
    - returns (n_response, n_frequency, n_path): of a vibration the pressure of the same level, see
      `Receiver.pressure_of_same_level` [Pa/N].
    - raises InputError: paths that a vehicle lacks or has beyond these; lines that differ.
    """
    values = np.empty((len(fleet.receivers), frequency.size, len(paths)), dtype=complex)
    transfers = [
        (vehicle, receiver, frf)
        for vehicle in fleet.vehicles
        for receiver, frf in vehicle.transfers.items()
    ]
    for (vehicle, receiver, frf), row in zip(transfers, values, strict=True):
        what = "noise transfer function" if receiver.is_sound else "transfer function"
        owner = f"vehicle {receiver.response_name(vehicle.name)}"
        missing = [path for path in paths if path not in frf.inputs]
        if missing:
            raise InputError(
                f"{owner}: no {what} of {missing}, there are "
                f"{list(frf.inputs)}: measure these paths or take them out of transfer_axes"
            )
        surplus = [name for name in frf.inputs if name not in paths]
        if surplus:
            raise InputError(
                f"{owner}: {what}s of {surplus} belong to no "
                "transfer axis of the mounts: add the axes to transfer_axes or leave these out"
            )
        transfer = frf.select(inputs=paths)
        lines = lines_inside(transfer.frequency, band, owner)
        if not np.array_equal(transfer.frequency[lines], frequency):
            raise InputError(
                f"{owner}: its {what}s have other lines than load "
                f"case {load_case} between {band[0]:g} and {band[1]:g} Hz: bring both to the same "
                "lines, nothing is interpolated here"
            )
        row[:] = transfer.values[lines, 0, :]
        if not receiver.is_sound:
            row *= receiver.pressure_of_same_level(frequency)[:, np.newaxis]
    return values


def with_loss_names(names: Sequence[str]) -> tuple[str, ...]:
    """Return the names of all stiffness factors, then of all loss factors."""
    return (*names, *(f"{name}{LOSS_SUFFIX}" for name in names))


def _split_forces(mounts: Sequence[Mount], load_case: LoadCase) -> tuple[LoadCase, LoadCase]:
    """Return a run with the elastic forces ``K' s`` alone, and one with the lossy ``j K'' s``.

    K is that along the axes of each mount.
    """
    along = in_mount_axes(mounts, load_case)
    displacement, force = along.displacement.values, along.force
    stiffness = dynamic_stiffness(force.values, displacement)
    elastic, lossy = stiffness.real * displacement, 1j * stiffness.imag * displacement
    return (
        in_vehicle_axes(mounts, replace(along, force=replace(force, values=elastic))),
        in_vehicle_axes(mounts, replace(along, force=replace(force, values=lossy))),
    )


@cache
def _blas() -> ThreadpoolController:
    """Return what controls the threads of BLAS; to look for it takes milliseconds."""
    return ThreadpoolController()
