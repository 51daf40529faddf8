"""Pages of keypoints and registrations."""

from fastapi import APIRouter

router = APIRouter()
