"""Pages of images."""

from fastapi import APIRouter

router = APIRouter()
