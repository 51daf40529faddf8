"""Pages of sites, cameras and viewports."""

from fastapi import APIRouter

router = APIRouter()
