"""Answers of evaluation that a caller may have already: tagged by their content."""

import hashlib
from collections.abc import Mapping, Sequence

from fastapi import Request, Response
from pydantic import BaseModel

from app.delivery import is_known, not_modified
from app.evaluation.plots import Plot
from app.evaluation.tables import TableFormat, csv_response
from app.templating import render


def tagged(
    request: Request,
    output: TableFormat,
    answer: BaseModel,
    name: str,
    columns: Sequence[str],
    rows: Sequence[Mapping[str, object]],
) -> Response:
    """Return an answer as JSON or CSV with its content as ETag; 304 to whoever has it."""
    if output is TableFormat.CSV:
        response = csv_response(f"quaymark-{name}", columns, rows)
    else:
        response = Response(answer.model_dump_json(), media_type="application/json")
    etag = f'"{hashlib.sha256(bytes(response.body)).hexdigest()[:32]}"'
    headers = {"ETag": etag, "Cache-Control": "private, no-cache"}
    if is_known(request, etag):
        return not_modified(headers)
    response.headers.update(headers)
    return response


def svg_file(name: str, plot: Plot) -> Response:
    """Return a plot as an SVG file."""
    return Response(
        render("evaluation/plot.svg", plot=plot).strip(),
        media_type="image/svg+xml",
        headers={"Content-Disposition": f'attachment; filename="quaymark-{name}.svg"'},
    )
