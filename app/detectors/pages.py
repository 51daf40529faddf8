"""Pages of detector models."""

from fastapi import APIRouter

router = APIRouter()
