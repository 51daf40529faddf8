"""The page of the registration editor: photograph and map side by side, filled by its island.

The page only says what does not change while it is open (the site's frame, the camera, where tiles
come from); keypoints, landmarks and solutions go through REST.
"""

from typing import Annotated

from fastapi import APIRouter, Request, Response

from app.auth.access import Access, Scope, allowed
from app.config import Settings
from app.dependencies import SessionDep
from app.registration import actions, conversion
from app.tables.sites import Viewport
from app.templating import page

router = APIRouter()
Reader = Annotated[Access, allowed(Scope.READ)]


@router.get("/viewports/{viewport_id:int}/register")
def show_editor(
    request: Request, viewport_id: int, session: SessionDep, access: Reader
) -> Response:
    """Show the editor; who may not register can look at everything in it."""
    viewport = actions.viewport_for(session, access, Scope.READ, viewport_id)
    camera = viewport.camera
    return page(
        request,
        "registration/editor.html",
        crumbs=[
            {"label": camera.site.name, "href": f"/sites/{camera.site_id}"},
            {"label": camera.name, "href": f"/cameras/{camera.id}"},
            {"label": viewport.name, "href": f"/viewports/{viewport.id}"},
        ],
        viewport=viewport,
        camera=camera,
        site=camera.site,
        world=_world(viewport),
        tiles=_tiles(request.app.state.settings),
        may_register=access.may(Scope.REGISTER, camera.site_id),
    )


def _world(viewport: Viewport) -> dict[str, object]:
    """Give what the island computes with: the site's frame and water, the camera's own lens."""
    site = viewport.camera.site
    return {
        "origin": {
            "lat_deg": site.origin_lat_deg,
            "lon_deg": site.origin_lon_deg,
            "height_m": site.origin_height_m,
        },
        "water_level_m": site.water_level_m,
        "intrinsics": conversion.intrinsics_to_json(conversion.intrinsics_of(viewport.camera)),
    }


def _tiles(settings: Settings) -> dict[str, str] | None:
    if not settings.map_tile_url:
        return None
    return {"url": settings.map_tile_url, "attribution": settings.map_attribution}
