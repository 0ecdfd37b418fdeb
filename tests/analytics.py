"""Runs the queries of docs/analytics.md on a folder: analytics.py PAGE FOLDER

    ```sql … ``` ─▶ DuckDB, in the order of the page ─▶ {"1": [{"line": "front", "hour": 1700000000.0, …}, …], …}

Prints the rows of each query under a heading "### N. …" as JSON. Times are seconds since 1970.
"""

import datetime
import json
import re
import sys
from pathlib import Path

import duckdb

EPOCH = datetime.datetime(1970, 1, 1, tzinfo=datetime.UTC)


def plain(value):
    """A value as it stands in JSON."""
    if isinstance(value, datetime.datetime):
        return (value - EPOCH).total_seconds()
    if isinstance(value, datetime.date):
        return value.isoformat()
    return value


def main(page: str, folder: str) -> None:
    """Runs them."""
    text = Path(page).read_text(encoding="utf-8")
    database = duckdb.connect()
    database.sql("LOAD icu")
    database.sql("SET TimeZone = 'UTC'")
    answers = {}
    number = None
    for heading, query in re.findall(r"^### (\d+)\.|^```sql\n(.*?)^```", text, re.DOTALL | re.MULTILINE):
        if heading:
            number = heading
            continue
        result = database.sql(query.replace("'lake/", f"'{folder}/"))
        if result is not None and number is not None:
            rows = result.fetchall()
            answers[number] = [dict(zip(result.columns, map(plain, row), strict=True)) for row in rows]
    print(json.dumps(answers))


if __name__ == "__main__":
    main(*sys.argv[1:])
