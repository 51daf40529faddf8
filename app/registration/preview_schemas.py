"""Request and answer of the solve preview: what an editor shows while keypoints are placed."""

from typing import Annotated, Literal, Self

from pydantic import BaseModel, Field, StringConstraints, model_validator

from app.domain.keypoints import SuspicionKind
from app.registration.schemas import MOST_KEYPOINTS, IntrinsicsOut, KeypointIn
from app.sites.fields import Place, Request
from app.tables.registration import KeypointRole, RegistrationMethod

SolvedMethod = Literal["pnp", "homography_water", "homography_pca"]
ALL_METHODS: tuple[SolvedMethod, ...] = ("pnp", "homography_water", "homography_pca")
Key = Annotated[str, StringConstraints(min_length=1, max_length=64)]
Line = list[list[float]]
Cells = list[list[float | None]]


class SolveKeypointIn(KeypointIn):
    """A keypoint as it is being edited; `key` is the editor's own and comes back."""

    key: Key | None = Field(None, description="Else its place in the list")


class SolveIn(Request):
    """What to solve: the keypoints given, or else the stored ones."""

    keypoints: list[SolveKeypointIn] | None = Field(None, max_length=MOST_KEYPOINTS)
    methods: list[SolvedMethod] = list(ALL_METHODS)  # noqa: RUF012  Pydantic copies it
    overlays: bool = Field(default=True, description="Horizon, grid, heat map and landmarks too")

    @model_validator(mode="after")
    def _distinct(self) -> Self:
        keys = [point.key for point in self.keypoints or [] if point.key is not None]
        if len(set(keys)) < len(keys):
            raise ValueError("two keypoints have the same key; give each its own")
        return self


class SolvePointOut(BaseModel):
    """A keypoint as the solver took it: its landmark in the site's ENU frame, metres."""

    key: str
    name: str
    role: KeypointRole
    landmark_id: int | None
    u_px: float
    v_px: float
    enu_m: list[float]
    range_m: float | None = Field(description="From the camera that was found")


class SolvedPointOut(BaseModel):
    """Where a method projects a keypoint; differences are projected minus observed."""

    key: str
    u_px: float | None
    v_px: float | None
    du_px: float | None
    dv_px: float | None
    error_px: float | None
    leave_one_out_px: float | None
    is_used: bool


class SolvedMethodOut(BaseModel):
    """A method's figures, or why it was refused."""

    method: RegistrationMethod
    error: str | None = None
    mae_px: float | None = None
    mae_inliers_px: float | None = None
    mae_pct_width: float | None = None
    mae_pct_height: float | None = None
    leave_one_out_px: float | None = None
    check_mae_px: float | None = None
    points: list[SolvedPointOut] = []
    warnings: list[str] = []


class SuspicionOut(BaseModel):
    """What is probably wrong, of which keypoints (of all: none), and what to do."""

    kind: SuspicionKind
    keys: list[str]
    message: str


class PriorsOut(BaseModel):
    """Sigmas of the fit: a keypoint's pixel, the relative focal length, k1."""

    pixel_px: float
    focal: float
    k1: float


class SolvedCameraOut(BaseModel):
    """The camera PnP found."""

    rotation: list[float] = Field(description="Rodrigues vector of cam_from_enu")
    R_cam_from_enu: list[list[float]]
    center: Place
    center_enu_m: list[float]
    center_sigma_m: list[float] = Field(description="East, north, up")
    height_above_water_m: float
    heading_deg: float
    pitch_deg: float = Field(description="Positive: it looks up")
    roll_deg: float
    intrinsics: IntrinsicsOut
    refined_from: IntrinsicsOut | None = Field(description="None: focal length and k1 were kept")
    focal_sigma_pct: float | None
    k1_sigma: float | None
    covariance: list[list[float]]
    parameter_covariance: list[list[float]]
    threshold_px: float
    is_widened: bool
    priors: PriorsOut
    water_sigma_px: float
    water_sigma_range_m: float


class HorizonOut(BaseModel):
    """The horizon's lines in the image, and how far it is."""

    distance_m: float
    lines: list[Line]


class GridLineOut(BaseModel):
    """A line of equal range or bearing on the water, with a place for its label."""

    kind: Literal["range", "bearing"]
    range_m: float | None = None
    bearing_deg: float | None = None
    label: str
    lines: list[Line]
    at_px: list[float] | None


class HeatMapOut(BaseModel):
    """One sigma of each cell's water, in px and m; null where no water is seen."""

    columns: int
    rows: int
    cell_px: list[float]
    sigma_px: Cells
    sigma_m: Cells
    range_m: Cells


class SeenLandmarkOut(BaseModel):
    """A landmark of the site that the image shows."""

    landmark_id: int
    name: str
    u_px: float
    v_px: float
    range_m: float
    is_placed: bool = Field(description="A keypoint of this viewport has it")


class NextPointOut(BaseModel):
    """Where the next keypoint helps most; sigmas are those of water 300 m away."""

    box_px: list[float]
    range_m: list[float] | None
    sigma_before_px: float | None
    sigma_after_px: float | None
    sentence: str


class ReadinessOut(BaseModel):
    """How far the keypoints are, in words."""

    level: Literal["too_few", "refused", "poor", "fair", "good"]
    control_points: int
    missing_for_solution: int
    missing_for_good: int
    sentences: list[str]
    warnings: list[str]
    next_point: NextPointOut | None


class SolveOut(BaseModel):
    """All methods side by side with what to draw. Nothing of it is stored."""

    water_level_m: float
    origin: Place
    points: list[SolvePointOut]
    methods: list[SolvedMethodOut]
    suspicions: list[SuspicionOut]
    camera: SolvedCameraOut | None
    horizon: HorizonOut | None
    grid: list[GridLineOut]
    heat_map: HeatMapOut | None
    landmarks: list[SeenLandmarkOut]
    readiness: ReadinessOut
