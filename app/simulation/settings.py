"""What can be turned up, down or off in a simulated harbour.

The defaults are moderately hostile, like a good receiver in a busy port. `perfect()` of each
switches every error off: then AIS says the truth to its resolution.
"""

from dataclasses import asdict, dataclass, replace

from app.simulation.ship_plans import Fleet


def _require_amounts(values: dict[str, object]) -> None:
    """Refuse negative or endless numbers, and shares above 1, by name."""
    for name, value in values.items():
        if not isinstance(value, int | float):
            continue
        highest = 1.0 if name.endswith("_share") and name != "edge_sigma_share" else 1e9
        if not 0 <= value <= highest:
            raise ValueError(f"{name} must lie between 0 and {highest:g}, got {value}")


@dataclass(frozen=True, slots=True)
class TrafficSettings:
    """Vessels and their AIS. Shares are probabilities from 0 to 1; sigmas are one deviation."""

    spacing_s: float = 36.0  # mean time between vessels that enter the view
    speed_factor: float = 1.0  # on the speeds that are usual of each type
    lead_in_s: float = 420.0  # AIS is heard this long before the first image: statics every 360 s
    moored_vessels: int = 2
    moored_with_ais_share: float = 0.35
    no_ais_share: float = 0.1
    class_b_share: float = 0.6  # of sailing boats and launches; all others carry class A
    class_a_without_heading_share: float = 0.08
    class_b_without_heading_share: float = 0.9
    position_sigma_m: float = 0.6  # from report to report
    bias_sigma_m: float = 2.5  # correlated over `bias_memory_s`
    bias_memory_s: float = 240.0
    heading_sigma_deg: float = 1.0  # a compass error, constant for a vessel
    course_sigma_deg: float = 1.5
    speed_sigma_kn: float = 0.1
    drift_sigma_deg: float = 1.5  # true angle between heading and course: wind and current
    dimension_sigma_m: float = 0.4  # of each of the four antenna distances, before rounding
    wrong_dimensions_share: float = 0.03  # ship entered with sizes of another
    loss_share: float = 0.06
    gap_share: float = 0.08  # vessels that fall silent for `gap_s`
    gap_s: float = 75.0
    delay_median_s: float = 0.5
    late_share: float = 0.03
    late_s: tuple[float, float] = (6.0, 40.0)
    duplicate_share: float = 0.15
    slot_jitter: bool = True  # reports leave within a tenth of their interval (ITU-R M.1371)
    millisecond_tags: bool = False

    def __post_init__(self) -> None:
        _require_amounts(asdict(self))
        if min(self.spacing_s, self.bias_memory_s, self.speed_factor) <= 0:
            raise ValueError("spacing_s, bias_memory_s and speed_factor must be above 0")

    @classmethod
    def perfect(cls) -> "TrafficSettings":
        """Every vessel is heard at once and says the truth."""
        return cls(
            moored_with_ais_share=1.0, no_ais_share=0.0, class_a_without_heading_share=0.0,
            class_b_without_heading_share=0.0, position_sigma_m=0.0, bias_sigma_m=0.0,
            heading_sigma_deg=0.0, course_sigma_deg=0.0, speed_sigma_kn=0.0, drift_sigma_deg=0.0,
            dimension_sigma_m=0.0, wrong_dimensions_share=0.0, loss_share=0.0, gap_share=0.0,
            delay_median_s=0.0, late_share=0.0, duplicate_share=0.0, slot_jitter=False,
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class DetectorSettings:
    """A detector of known quality: its boxes come from the truth, with errors."""

    edge_sigma_px: float = 1.2
    edge_sigma_share: float = 0.012  # of the box's width or height, added to the above
    least_visible_share: float = 0.3  # hidden more than this, a vessel is missed
    least_size_px: float = 10.0
    miss_share: float = 0.04
    false_positives_per_image: float = 0.15
    moored_share: float = 0.5  # moored vessels are harder to tell from the quay

    def __post_init__(self) -> None:
        _require_amounts(asdict(self))

    @classmethod
    def perfect(cls) -> "DetectorSettings":
        """Exact boxes of everything that can be seen."""
        return cls(
            edge_sigma_px=0.0, edge_sigma_share=0.0, least_visible_share=0.0, least_size_px=0.0,
            miss_share=0.0, false_positives_per_image=0.0, moored_share=1.0,
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class HarbourSettings:
    """All settings of a harbour beside its seed and image size."""

    traffic: TrafficSettings = TrafficSettings()
    detector: DetectorSettings = DetectorSettings()
    tide_amplitude_m: float = 0.4
    click_sigma_px: float = 1.0
    images_per_session: int = 8
    fleet: Fleet = Fleet.TRAINING

    def __post_init__(self) -> None:
        _require_amounts(asdict(self))
        if self.images_per_session < 1:
            raise ValueError("images_per_session must be at least 1")

    @classmethod
    def perfect(cls) -> "HarbourSettings":
        """Return a harbour without any error: what is left is the method's own."""
        return replace(
            cls(traffic=TrafficSettings.perfect(), detector=DetectorSettings.perfect()),
            tide_amplitude_m=0.0,
            click_sigma_px=0.0,
        )
