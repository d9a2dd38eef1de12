"""The command line of the virtual test bench: platform, campaign, vehicle, compressor."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from deboom.bench.choices import CalibrationLevel, CompressorCase, HoseCase

bench_app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="The virtual test bench: measurement files that look real, with known truth.",
)

Folder = Annotated[Path, typer.Argument(help="A new or empty folder for the files.")]
Seed = Annotated[
    int,
    typer.Option(
        help="Seed of errors, noise and the measured object, 1 or higher; with 1, "
        "platform and vehicle are those of the shipped fleet."
    ),
]
TruthSeed = Annotated[
    int,
    typer.Option(
        help="Seed of the true properties, 1 or higher; 1 gives those that are shipped. It draws "
        "the powertrain with three or four cylinders, laws of the mounts, torque and gears, and "
        "the unbalance and sense of rotation of a compressor. The best designs of 20 such "
        "platforms change the level by -4.3 to -2.6 dB per line (10 to 90 %), with seed 1 by -3.1 "
        "dB."
    ),
]
Tilt = Annotated[
    float,
    typer.Option(
        help="Tilt each powertrain mount by this angle [deg], about an axis that --truth-seed "
        "draws; mounts.csv states the angles."
    ),
]
BodyScatter = Annotated[
    float,
    typer.Option(
        help="Factor on the differences between cars of one drawing [1]. Their noise transfer "
        "functions span 6 dB with 1, and 11 dB with 2; the literature has 10 to 15 dB. It needs "
        "--seed 2 or higher."
    ),
]
Family = Annotated[
    str,
    typer.Option(
        help="Other bodies, rubber or laboratory, separated by commas. Bodies: attachments, light, "
        "battery, truck. Factors, with a value or drawn: stiffness (in the car over the test, 0.85 "
        "to 1.15), apart (mounts, 0 to 0.1), payne (0.4 to 3), noise (0.5 to 4), gaps (lines "
        "missing, 0 to 0.1), dead (a sensor, 0 or 1). Try attachments,stiffness=0.9,noise."
    ),
]
NoiseFree = Annotated[
    bool,
    typer.Option(
        "--noise-free",
        help="Write data without noise, with every sensor and hit exactly as stated.",
    ),
]
Level = Annotated[
    CalibrationLevel,
    typer.Option(
        help="Errors of sensors and impacts, 1 sigma of gain, position and angle. C0.5: 0.5 %, 0.5 "
        "mm, 0.5 deg; C1: 1 %, 1 mm, 1 deg; C2: 2 %, 1.5 mm, 1.5 deg; C3: 3 %, 2 mm, 2 deg."
    ),
]
Case = Annotated[
    CompressorCase,
    typer.Option(
        help="Mounts: table11 takes those of the thesis, random draws them around the drawing."
    ),
]
IdenticalMounts = Annotated[
    bool, typer.Option("--identical-mounts", help="Use one round part for all mounts.")
]
Softening = Annotated[
    bool, typer.Option("--softening", help="Let the mounts soften with their amplitude.")
]
FlexibleReceiver = Annotated[
    bool,
    typer.Option(
        "--flexible-receiver", help="Put the compressor on a subframe with a mode at 38 Hz."
    ),
]
Hoses = Annotated[
    HoseCase,
    typer.Option(
        help="Standard hoses. drawn: as in the catalogue; scattered: stiffness, mass and loss 0.75 "
        "to 1.3 times the catalogue; displaced: ports, directions and lengths differ as well."
    ),
]
HammerWithHoses = Annotated[
    bool, typer.Option("--hammer-with-hoses", help="Also write a hammer test with standard hoses.")
]
MountStorage = Annotated[
    float,
    typer.Option(
        help="Real part of the mounts' stiffness in operation, over that in the hammer test [1]. "
        "Temperature, preload and amplitude change it. Try 0.9: then the thesis's route errs below "
        "50 Hz."
    ),
]
MountLoss = Annotated[
    float, typer.Option(help="The same ratio for the imaginary part [1]. Try 1.1.")
]


def example(folder: Folder) -> None:
    """Write invented measurements for trying the guides.

    The folder gets a platform of two cars, a campaign, a hammer test of a compressor, a mount on a
    rig, parts of a delivery, limits of levels and a table of levels. README.txt says which command
    takes which.

    Try: deboom example example
    """
    from deboom.bench.example import write_example
    from deboom.progress import progress_bar

    with progress_bar("example") as progress:
        write_example(folder, progress)
    typer.echo(folder.as_posix())


@bench_app.command("write")
def write(
    folder: Folder,
    seed: Seed = 1,
    truth_seed: TruthSeed = 1,
    tilt: Tilt = 0.0,
    library: Annotated[
        bool,
        typer.Option("--library", help="Also characterise the mounts, which takes half a minute."),
    ] = False,
    per_piece: Annotated[
        bool,
        typer.Option("--per-piece", help="Write one transfer function for each wishbone mount."),
    ] = False,
    receptance: Annotated[
        bool,
        typer.Option(
            "--receptance",
            help="Write the receptance of each body at the mounts (UFF). Coupled motion then "
            "includes the motion of the body.",
        ),
    ] = False,
    driving_points: Annotated[
        bool,
        typer.Option(
            "--driving-points",
            help="Write of each body the driving points at the mounts alone (UFF). In coupled "
            "motion each point then gives way to its own force.",
        ),
    ] = False,
    receivers: Annotated[
        bool,
        typer.Option(
            "--receivers",
            help="Write functions to a rear ear, the seat rail and the wheel, and a run at idle, "
            "as well (UFF).",
        ),
    ] = False,
    body_scatter: BodyScatter = 1.0,
    family: Family = "",
) -> None:
    """Write the measurement files of a virtual platform.

    Noise transfer functions of 15 vehicles (UFF), operating displacement and force spectra at the
    mounts (UFF), tables of mounts and channels (CSV) and a platform.toml that names them. The exact
    truth goes to the folder `truth/`, which no study reads.
    """
    from deboom.bench.platform_writer import write_platform
    from deboom.progress import progress_bar
    from deboom.runs.campaigns import write_platform_library
    from deboom.vehicles.platform import LIBRARY_FILE

    with progress_bar("virtual bench") as progress:
        write_platform(
            folder,
            seed=seed,
            progress=progress,
            per_piece=per_piece,
            truth_seed=truth_seed,
            tilt=tilt,
            receptance=receptance,
            driving_points=driving_points,
            receivers=receivers,
            body_scatter=body_scatter,
            family=family,
        )
    if library:
        with progress_bar("mount library") as progress:
            write_platform_library(folder / LIBRARY_FILE, seed, progress, truth_seed, tilt, family)
    else:
        typer.echo(
            "no mount library: studies need --mounts spectra, or write the platform with --library",
            err=True,
        )
    typer.echo(folder.as_posix())


@bench_app.command("campaign")
def campaign(
    folder: Folder,
    seed: Seed = 1,
    truth_seed: TruthSeed = 1,
    tilt: Tilt = 0.0,
    mount_set: Annotated[
        list[str] | None,
        typer.Option(
            help="Set of mounts: M0 is as drawn, M1 and higher are scattered, "
            "EnM1-GeM2-TSM3-Du4 is mixed; repeatable."
        ),
    ] = None,
    noise_free: NoiseFree = False,
    time_run: Annotated[
        bool, typer.Option("--time-run", help="Also write one run as time data with a tacho.")
    ] = False,
    family: Family = "",
) -> None:
    """Write a measurement campaign: raw channels of runs, shaker runs, suppliers' curves.

    Runs in gears 3 to 7, at full load with torque limits and as load slices, rising and falling
    (UFF, one file per run), the position sheet, and a campaign.toml that names them. `deboom
    characterise` makes mounts of the campaign. The exact truth goes to the folder `truth/`, which
    commands read only for comparison.
    """
    from deboom.bench.campaign import (
        FULL_PLAN,
        NO_ERRORS,
        CampaignErrors,
        CampaignPlan,
        TimeRunPlan,
    )
    from deboom.bench.campaign_writer import write_campaign
    from deboom.bench.families import draw_family
    from deboom.bench.powertrain import load_bench
    from deboom.progress import progress_bar

    sets = tuple(mount_set or FULL_PLAN.mount_sets)
    plan = CampaignPlan(
        mount_sets=sets,
        time_run=TimeRunPlan(mount_set=sets[0]) if time_run else None,
    )
    errors = NO_ERRORS if noise_free else CampaignErrors()
    with progress_bar("virtual bench") as progress:
        bench, drawn = load_bench(truth_seed, tilt), draw_family(family, seed, truth_seed)
        write_campaign(folder, seed, plan, errors, progress, bench, drawn)
    typer.echo(folder.as_posix())


@bench_app.command("vehicle")
def vehicle(
    folder: Folder,
    seed: Seed = 1,
    truth_seed: TruthSeed = 1,
    tilt: Tilt = 0.0,
    name: Annotated[str, typer.Option("--vehicle", help="Vehicle of the fleet.")] = "U06-1",
    mount_set: Annotated[
        str, typer.Option(help="Mounts of its powertrain, such as M0, M1 or EnM1-GeM2-TSM3-Du4.")
    ] = "M1",
    body_scatter: BodyScatter = 1.0,
    noise_free: NoiseFree = False,
    family: Family = "",
) -> None:
    """Write one vehicle as a laboratory measures it.

    Noise transfer functions with the hammer and with a loudspeaker, at the driver's and the
    passenger's ear; runs of the complete car on its flexible body: pressure at the ears,
    acceleration on both sides of every mount (UFF), and a vehicle.toml that names them. The exact
    truth goes to the folder `truth/`, which no study reads.
    """
    from deboom.bench.vehicle_writer import NO_VEHICLE_ERRORS, VehicleErrors, write_vehicle
    from deboom.progress import progress_bar

    with progress_bar("virtual vehicle") as progress:
        errors = NO_VEHICLE_ERRORS if noise_free else VehicleErrors()
        write_vehicle(
            folder,
            seed,
            name,
            mount_set,
            errors,
            progress=progress,
            truth_seed=truth_seed,
            tilt=tilt,
            body_scatter=body_scatter,
            family=family,
        )
        typer.echo(folder.as_posix())


@bench_app.command("compressor")
def compressor(
    folder: Folder,
    level: Level = CalibrationLevel.C2,
    seed: Seed = 1,
    case: Case = CompressorCase.RANDOM,
    identical_mounts: IdenticalMounts = False,
    softening: Softening = False,
    flexible_receiver: FlexibleReceiver = False,
    flexible_body: Annotated[
        float,
        typer.Option(
            help="Frequency at which the two parts of the body swing [Hz]; 0 means a rigid body."
        ),
    ] = 0.0,
    hits: Annotated[
        bool, typer.Option("--hits", help="Also write every hit over time (30 MB).")
    ] = False,
    free: Annotated[
        bool,
        typer.Option("--free", help="Hang the compressor from soft cords, for `identify --free`."),
    ] = False,
    noise_free: NoiseFree = False,
) -> None:
    """Write a roving-hammer test on a mounted refrigerant compressor.

    FRFs from 18 impacts to 6 triaxial accelerometers and their coherence (UFF), the position sheet
    (Excel), and a compressor_test.toml that names them and states tolerances, weighed mass and
    drawing. The exact truth goes to the folder `truth/`, which no identification reads.

    Try: deboom bench compressor hammer_test --level C2 --seed 1
    """
    from deboom.bench.compressor_truth import CompressorPlan
    from deboom.bench.compressor_writer import write_compressor_test

    plan = CompressorPlan(
        case, identical_mounts, softening, flexible_receiver, flexible_body, hits, free
    )
    write_compressor_test(folder, seed, level, plan, noise_free=noise_free)
    typer.echo(folder.as_posix())


@bench_app.command("operation")
def operation(
    folder: Folder,
    level: Level = CalibrationLevel.C2,
    seed: Seed = 1,
    truth_seed: TruthSeed = 1,
    case: Case = CompressorCase.RANDOM,
    hoses: Hoses = HoseCase.SCATTERED,
    hammer_with_hoses: HammerWithHoses = False,
    mount_storage: MountStorage = 1.0,
    mount_loss: MountLoss = 1.0,
    softening: Softening = False,
    flexible_receiver: FlexibleReceiver = False,
    sense: Annotated[
        int, typer.Option(help="Sense of rotation: 1 from y to z, -1 from z to y.")
    ] = 1,
    time_record: Annotated[
        bool,
        typer.Option("--time-record", help="Also write a run-up over time with a tacho (3 MB)."),
    ] = False,
    noise_free: NoiseFree = False,
) -> None:
    """Write the test of a running refrigerant compressor: its unbalance shakes it.

    A hammer test without hoses (hammer/); speed sweeps from 1000 to 9000 1/min at 7.5 and 13.5 bar,
    with the hoses of the vehicle and with long soft hoses, as spectra of first order with the speed
    of the tacho (sweeps/, UFF); and an operation.toml that names them and the hoses of the drawing.
    Six unbalances together make 20 g mm and 1200 g mm². Gas forces grow with the pressure,
    unbalances do not. The exact truth goes to the folder `truth/`, which no identification reads.

    Try: deboom bench operation running --hammer-with-hoses --mount-storage 0.9 --mount-loss 1.1
    """
    from deboom.bench.compressor_rig import OperationPlan
    from deboom.bench.compressor_truth import CompressorPlan
    from deboom.bench.compressor_writer import write_operating_test

    plan = OperationPlan(
        CompressorPlan(case, softening=softening, flexible_receiver=flexible_receiver),
        hoses,
        hammer_with_hoses,
        mount_storage,
        mount_loss,
        softening,
        sense,
        time_record,
        truth_seed,
    )
    write_operating_test(folder, seed, level, plan, noise_free=noise_free)
    typer.echo(folder.as_posix())


@bench_app.command("electric-car")
def electric_car(
    folder: Folder,
    car: Annotated[str, typer.Option(help="Car of the fleet, EV-1 to EV-5.")] = "EV-1",
    fleet: Annotated[
        int | None, typer.Option(help="Seed of a random fleet; default: the shipped fleet.")
    ] = None,
    level: Level = CalibrationLevel.C2,
    seed: Seed = 1,
    truth_seed: TruthSeed = 1,
    identical_mounts: IdenticalMounts = False,
    hoses: Hoses = HoseCase.SCATTERED,
    hammer_with_hoses: HammerWithHoses = False,
    mount_storage: MountStorage = 1.0,
    mount_loss: MountLoss = 1.0,
    noise_free: NoiseFree = False,
    family: Family = "",
) -> None:
    """Write one electric car and its compressor as a laboratory measures them.

    A hammer test of the compressor (hammer/); sweeps in the car, with the hoses of the car and with
    long soft hoses, at compressor, body side of every mount and driver's ear (sweeps/,
    operation.toml); a hammer test of the body around every mount and hose end, without the
    compressor, with pressure at the ear and acceleration (ntf/, car.toml). The exact truth goes to
    the folder `truth/`, which no study reads.

    Try: deboom bench electric-car car --car EV-2 --hammer-with-hoses
    """
    from deboom.bench.compressor_rig import OperationPlan
    from deboom.bench.compressor_truth import CompressorPlan
    from deboom.bench.electric_car_writer import write_electric_car

    plan = OperationPlan(
        CompressorPlan(CompressorCase.TABLE11, identical_mounts),
        hoses,
        hammer_with_hoses,
        mount_storage,
        mount_loss,
        truth_seed=truth_seed,
    )
    write_electric_car(folder, seed, car, fleet, level, plan, noise_free=noise_free, family=family)
    typer.echo(folder.as_posix())


@bench_app.command("component")
def component(
    folder: Folder,
    level: Level = CalibrationLevel.C2,
    seed: Seed = 1,
    truth_seed: Annotated[
        int,
        typer.Option(
            help="Seed of the source, of both bodies and of the loads in the source, 1 or higher."
        ),
    ] = 1,
    points: Annotated[
        int, typer.Option(help="Number of points that connect source and body, 1 to 3.")
    ] = 3,
    unmeasured_rotations: Annotated[
        bool,
        typer.Option(
            "--unmeasured-rotations",
            help="State three degrees of freedom per point, although moments act as well.",
        ),
    ] = False,
    unmeasured_point: Annotated[
        bool,
        typer.Option(
            "--unmeasured-point", help="Add a bracket between source and body that nobody measured."
        ),
    ] = False,
    airborne: Annotated[
        float,
        typer.Option(
            help="Energy at the ears through the air, over the energy through the structure "
            "[1]. Try 1."
        ),
    ] = 0.0,
    noise_free: NoiseFree = False,
) -> None:
    """Write a test of component TPA: a source on a body, struck and run, and another body.

    Functions from hits around every point, and on the source, to accelerometers and ears with their
    coherence; spectra of two runs (runs/); the source alone, hung up freely; all in UFF, and a
    component.toml that names them. In receiver/ another body with mounts, on which the source ran
    as well. The exact truth goes to the folder `truth/`, which no analysis reads but to compare.

    Try: deboom bench component drive --airborne 1
    """
    from deboom.bench.component import ComponentPlan
    from deboom.bench.component_writer import write_component_test

    plan = ComponentPlan(points, unmeasured_rotations, float(unmeasured_point), airborne)
    write_component_test(folder, seed, level, plan, truth_seed=truth_seed, noise_free=noise_free)
    typer.echo(folder.as_posix())
