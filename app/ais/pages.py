"""Pages of AIS files, vessels and tracks."""

from fastapi import APIRouter

router = APIRouter()
