"""The ledger: what was made from what, how often tried, how long it took.

It only spares looking: the folders and the records beside them say the same, and a ledger that is
lost, or that an earlier version or a crash left unreadable, is filled again from them.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager, suppress
from pathlib import Path

from devcad.batch.places import marked
from devcad.batch.prints import Facts
from devcad.batch.tasks import Record, from_plain, to_plain

FORM = 1
"""Of the tables; a ledger of another form is made anew."""
TABLES = f"""
PRAGMA user_version = {FORM};
CREATE TABLE IF NOT EXISTS parts (
    name TEXT PRIMARY KEY, state TEXT, exit INTEGER, cause TEXT, message TEXT,
    attempts INTEGER, seconds REAL, record TEXT
) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS jobs (sha256 TEXT PRIMARY KEY, name TEXT, inputs TEXT) WITHOUT ROWID;
"""


class Ledger:
    """The ledger of a batch, open; ``records`` are those it held, by name."""

    def __init__(self, database: sqlite3.Connection) -> None:
        self._database = database
        self.records = _records(database)

    def keep(self, record: Record) -> None:
        """Commit a record; a full disk goes without, as the folders say the same."""
        result = record.result
        row = (
            record.name,
            result.state,
            result.exit,
            result.cause,
            result.message,
            record.attempts,
            result.seconds,
            json.dumps(to_plain(record)),
        )
        with suppress(sqlite3.Error):
            self._database.execute("INSERT OR REPLACE INTO parts VALUES (?,?,?,?,?,?,?,?)", row)

    def facts(self) -> dict[str, Facts]:
        """What job files say, by the hash of their bytes."""
        rows = self._database.execute("SELECT sha256, name, inputs FROM jobs")
        return {sha: Facts(name, tuple(json.loads(inputs))) for sha, name, inputs in rows}

    def learn(self, facts: Mapping[str, Facts]) -> None:
        """Keep what job files say."""
        rows = [(sha, one.name, json.dumps(one.inputs)) for sha, one in facts.items()]
        with suppress(sqlite3.Error):
            self._database.execute("BEGIN")
            self._database.executemany("INSERT OR IGNORE INTO jobs VALUES (?,?,?)", rows)
            self._database.execute("COMMIT")


@contextmanager
def opened(state: Path, mark: str = "") -> Iterator[Ledger]:
    """The ledger in a batch's own folder, made where there is none that can be read."""
    with closing(_database(state / marked("ledger.sqlite", mark))) as database:
        yield Ledger(database)


def _database(path: Path) -> sqlite3.Connection:
    """A connection to a sound ledger; one in memory where the disk takes none."""
    for again in (False, True):
        if again:
            for ending in ("", "-wal", "-shm"):
                with suppress(OSError):
                    path.with_name(path.name + ending).unlink(missing_ok=True)
        with suppress(sqlite3.Error, OSError, ValueError, KeyError, TypeError):
            return _sound(path)
    return _prepared(sqlite3.connect(":memory:", isolation_level=None))


def _sound(path: Path) -> sqlite3.Connection:
    """The ledger at a path, every row of it read."""
    database = sqlite3.connect(path, isolation_level=None)
    try:
        if database.execute("PRAGMA user_version").fetchone()[0] not in (0, FORM):
            raise sqlite3.DatabaseError("a ledger of another form")
        database.execute("PRAGMA journal_mode = WAL")
        database.execute("PRAGMA synchronous = NORMAL")
        _prepared(database)
        _records(database)
    except BaseException:
        database.close()
        raise
    return database


def _prepared(database: sqlite3.Connection) -> sqlite3.Connection:
    database.executescript(TABLES)
    return database


def _records(database: sqlite3.Connection) -> dict[str, Record]:
    rows = database.execute("SELECT name, record FROM parts")
    return {name: from_plain(json.loads(record)) for name, record in rows}
