"""The mount library: characterised mounts in a database, the same for one engineer and for many.

An SQLite file by default, PostgreSQL by its URL. Every import is one transaction: after a crash the
library is as it was before.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Self, TypeVar

from sqlalchemy import Select, delete, select
from sqlalchemy.orm import Session

from deboom.errors import InputError
from deboom.mounts.characterised_mount import CampaignRecord, CharacterisedMount, MountIdentity
from deboom.mounts.library_database import Database, database
from deboom.mounts.library_rows import (
    campaign_of,
    campaign_row,
    mount_of,
    mount_row,
)
from deboom.mounts.library_schema import CampaignRow, MountRow
from deboom.mounts.library_versions import (
    check_version,
    make_tables,
    migrate_tables,
    stored_version,
)

T = TypeVar("T")
TIMEOUT = 10.0
"""How long a transaction waits for other programs, unless said otherwise [s]."""


class MountLibrary:
    """Characterised mounts and their campaigns; made by `open_library`.

    Parameters
    ----------
    database : Database
        Holds the tables of this version.

    Notes
    -----
    A connection lasts for one call only: nothing is locked, and no server is kept waiting, between
    two calls. The context manager gives back what the engine still holds.
    """

    def __init__(self, database: Database) -> None:
        self._database = database

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Give back all connections."""
        self._database.engine.dispose()

    @property
    def name(self) -> str:
        """Path, or URL without its password."""
        return self._database.name

    def campaigns(self) -> tuple[CampaignRecord, ...]:
        """Return all campaigns by name."""
        with self._reading() as session:
            rows = session.scalars(select(CampaignRow).order_by(CampaignRow.name))
            return tuple(campaign_of(row) for row in rows)

    def identities(
        self,
        *,
        campaign: str | None = None,
        mount: str | None = None,
        variant: str | None = None,
        part_number: str | None = None,
        serial: str | None = None,
    ) -> tuple[MountIdentity, ...]:
        """Return which mounts there are, sorted; what is left out is not asked for.

        Parameters
        ----------
        campaign, mount, variant, part_number, serial : str, optional
            As in `MountIdentity`.
        """
        asked = {
            CampaignRow.name: campaign,
            MountRow.mount: mount,
            MountRow.variant: variant,
            MountRow.part_number: part_number,
            MountRow.serial: serial,
        }
        columns = (
            CampaignRow.name,
            MountRow.mount,
            MountRow.variant,
            MountRow.part_number,
            MountRow.supplier,
            MountRow.serial,
        )
        query = select(*columns).join(MountRow.campaign)
        for column, value in asked.items():
            if value is not None:
                query = query.where(column == value)
        with self._reading() as session:
            return tuple(sorted(MountIdentity(*row) for row in session.execute(query)))

    def find(
        self,
        *,
        campaign: str | None = None,
        mount: str | None = None,
        variant: str | None = None,
        part_number: str | None = None,
        serial: str | None = None,
    ) -> MountIdentity:
        """Return the one mount that is asked for, as `identities` does.

        Raises
        ------
        InputError
            None, or more than one: the candidates are named.
        """
        found = self.identities(
            campaign=campaign,
            mount=mount,
            variant=variant,
            part_number=part_number,
            serial=serial,
        )
        if len(found) == 1:
            return found[0]
        if found:
            raise InputError(
                f"{self.name}: {len(found)} mounts fit, say which one by its campaign, variant, "
                f"part number or serial: {_some(found)}"
            )
        there = self.identities()
        raise InputError(f"{self.name}: no such mount; there {_some(there) or 'is none at all'}")

    def load(self, identity: MountIdentity) -> CharacterisedMount:
        """Return a mount exactly as it was added.

        Raises
        ------
        InputError
            It is not in the library, or its arrays are damaged.
        """
        with self._reading() as session:
            row = session.scalar(_matching(select(MountRow), identity))
            if row is None:
                raise InputError(f"{self.name}: {identity} is not in the library")
            return mount_of(row)

    def add(
        self,
        campaigns: Sequence[CampaignRecord],
        mounts: Sequence[CharacterisedMount],
        *,
        replace: bool = False,
    ) -> None:
        """Import mounts and their campaigns: all of them, or after any failure none.

        Parameters
        ----------
        campaigns : sequence of CampaignRecord
            Those of the mounts. One that is there already, from the same files, is not made anew.
        mounts : sequence of CharacterisedMount
            Of these campaigns.
        replace : bool
            Whether a mount that is there already is exchanged, and a campaign of other content
            with all its mounts.

        Raises
        ------
        InputError
            A mount of another campaign or twice; without `replace`, a mount or another campaign of
            this name that is there already; a library that is locked or may not be written to.
        """
        campaigns, mounts = tuple(campaigns), tuple(mounts)
        _check_complete(campaigns, mounts)
        with self._database.writing() as session:
            check_version(session, self.name)
            parents = {
                campaign.name: self._campaign_row(session, campaign, replace)
                for campaign in campaigns
            }
            for value in mounts:
                there = session.scalar(_matching(select(MountRow.id), value.identity))
                if there is not None and not replace:
                    raise InputError(
                        f"{self.name}: {value.identity} is there already; replace it, or give the "
                        "new one another serial"
                    )
                session.execute(delete(MountRow).where(MountRow.id == there))
                session.add(mount_row(value, parents[value.identity.campaign]))
                session.flush()

    def _campaign_row(
        self, session: Session, campaign: CampaignRecord, replace: bool
    ) -> CampaignRow:
        named = select(CampaignRow).where(CampaignRow.name == campaign.name)
        there = session.scalars(named).one_or_none()
        if there is not None:
            if campaign_of(there) == campaign:
                return there
            if not replace:
                raise InputError(
                    f"{self.name}: there is another campaign {campaign.name}, of other files or "
                    "tolerances; replace it with all its mounts, or rename the new one"
                )
            session.delete(there)
            session.flush()
        row = campaign_row(campaign)
        session.add(row)
        return row

    @contextmanager
    def _reading(self) -> Iterator[Session]:
        with self._database.reading() as session:
            check_version(session, self.name)
            yield session


def open_library(
    where: str | Path, *, create: bool = False, timeout: float = TIMEOUT
) -> MountLibrary:
    """Open a mount library.

    Parameters
    ----------
    where : str or Path
        Path of an SQLite file, or a URL such as ``postgresql://user@host/database``.
    create : bool
        Whether to make it where there is none.
    timeout : float
        How long each call waits while another program writes [s].

    Returns
    -------
    MountLibrary
        A context manager.

    Raises
    ------
    InputError
        There is no library, it is of another version, damaged, locked or cannot be reached.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with open_library(Path(folder) / "mounts.db", create=True) as library:
    ...         library.identities(mount="TSM")
    ()
    """
    place = database(where, create=create, timeout=timeout)
    with place.reading() as session:
        missing = create and stored_version(session) is None
    if missing:
        with place.writing() as session:
            if stored_version(session) is None:
                make_tables(session, place)
    with place.reading() as session:
        check_version(session, place.name)
    return MountLibrary(place)


def migrate_library(where: str | Path, *, timeout: float = TIMEOUT) -> tuple[int, int]:
    """Bring an older library to the version of this deboom, in one transaction.

    Parameters
    ----------
    where, timeout
        As for `open_library`.

    Returns
    -------
    before, after : int
        Versions; equal if there was nothing to do.

    Raises
    ------
    InputError
        There is no library, it is newer than this deboom, damaged, locked or cannot be reached.
    """
    place = database(where, create=False, timeout=timeout)
    with place.writing() as session:
        return migrate_tables(session, place.name)


def _matching(query: Select[T], identity: MountIdentity) -> Select[T]:
    return query.join(MountRow.campaign).where(
        CampaignRow.name == identity.campaign,
        MountRow.mount == identity.mount,
        MountRow.variant == identity.variant,
        MountRow.part_number == identity.part_number,
        MountRow.serial == identity.serial,
    )


def _check_complete(
    campaigns: Sequence[CampaignRecord], mounts: Sequence[CharacterisedMount]
) -> None:
    names = [campaign.name for campaign in campaigns]
    # the supplier belongs to a part number, it does not tell mounts apart
    keys = [replace(value.identity, supplier="") for value in mounts]
    for value, key in zip(mounts, keys, strict=True):
        if names.count(value.identity.campaign) != 1:
            raise InputError(f"{value.identity}: its campaign must be imported with it, once")
        if keys.count(key) > 1:
            raise InputError(f"{value.identity} is to be imported twice; give each a serial")


def _some(identities: Sequence[MountIdentity]) -> str:
    more = f"; and {len(identities) - 4} more" if len(identities) > 4 else ""
    return "; ".join(str(identity) for identity in identities[:4]) + more
