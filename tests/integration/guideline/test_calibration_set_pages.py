"""The pages of calibration sets, as a lead and as a newcomer walk through them."""

from collections.abc import Callable

from starlette.testclient import TestClient

from app.db import Database
from app.tables.identity import Role, User
from app.tables.practice import JudgedPose
from app.tables.reviews import Grade
from tests.factories.runs import make_harbour, make_pose, make_review, make_run
from tests.integration.conftest import MakeUser

Browser = Callable[[User], TestClient]


def _lead_with_verdicts(database: Database, lead: User) -> tuple[int, list[int]]:
    """Store a run with an OK and a commented Bad pose of a lead; return run and pose ids."""
    with database.writing() as session:
        harbour = make_harbour(session)
        run = make_run(session, harbour)
        poses = [make_pose(session, run, harbour.images[0], mmsi) for mmsi in (1, 2, 3)]
        make_review(session, poses[0], lead.id, Grade.OK, reasons=["heading"])
        make_review(session, poses[1], lead.id, Grade.BAD, comment="Look at the <mast>")
        return run.id, [pose.id for pose in poses]


def test_a_lead_makes_a_set_from_own_verdicts_and_a_newcomer_walks_through(
    database: Database, make_user: MakeUser, browser_of: Browser
) -> None:
    """From the form to the result: each judgement is told, at the end where they differ."""
    lead, newcomer = make_user(Role.OPERATOR), browser_of(make_user(Role.REVIEWER))
    run_id, pose_ids = _lead_with_verdicts(database, lead)
    form = {"run_id": run_id, "name": "First week", "source": "own", "size": 5, "seed": 2}
    made = browser_of(lead).post("/calibration-sets", data=form)
    assert made.status_code == 303
    place = made.headers["location"]
    practice = f"{place}/practice"
    for _ in range(2):
        shown = newcomer.get(practice).text
        pose_id = next(number for number in pose_ids if f'name="pose_id" value="{number}"' in shown)
        told = newcomer.post(practice, data={"pose_id": pose_id, "grade": "ok"})
        answer = newcomer.get(told.headers["location"]).text
        is_ok = pose_id == pose_ids[0]
        assert ("As judged" in answer) is is_ok
        assert ("Look at the &lt;mast&gt;" in answer) is not is_ok
    assert newcomer.get(practice).headers["location"] == place
    result = newcomer.get(place).text
    assert "1 of 2 answered" in result
    assert "Judgements, to mend them" not in result
    assert newcomer.post(f"{place}/restart").headers["location"] == practice
    assert 'name="pose_id"' in newcomer.get(practice).text


def test_a_lead_mends_judgements_on_the_page(
    database: Database, make_user: MakeUser, browser_of: Browser
) -> None:
    """A note is changed and keeps its reasons, another pose taken out, nonsense is refused."""
    lead = make_user(Role.OPERATOR)
    run_id, (first, second, _) = _lead_with_verdicts(database, lead)
    browser = browser_of(lead)
    form = {"run_id": run_id, "name": "First week", "source": "own"}
    place = browser.post("/calibration-sets", data=form).headers["location"]
    browser.post(f"{place}/poses/{first}", data={"grade": "ok", "note": "turned"})
    browser.post(f"{place}/poses/{second}", data={"grade": "remove"})
    assert browser.post(f"{place}/poses/{first}", data={"grade": "x"}).status_code == 422
    with database.reading() as session:
        (judged,) = session.query(JudgedPose).all()
        assert (judged.pose_id, judged.grade, judged.note) == (first, Grade.OK, "turned")
        assert judged.reasons == ["heading"]
    assert browser.post(f"{place}/delete").headers["location"] == "/deletions"
    assert browser.get(place).status_code == 404


def test_a_run_without_truth_says_what_to_do(
    database: Database, make_user: MakeUser, browser_of: Browser
) -> None:
    """The form comes back with the reason, and nothing is stored."""
    lead = make_user(Role.OPERATOR)
    run_id, _ = _lead_with_verdicts(database, lead)
    form = {"run_id": run_id, "name": "By truth", "source": "truth"}
    answer = browser_of(lead).post("/calibration-sets", data=form)
    assert answer.status_code == 409
    assert "only simulated sites have one" in answer.text
    assert "No calibration set yet" in answer.text
