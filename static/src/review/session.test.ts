import { describe, expect, it } from "vitest";
import type { Grade, Pose } from "./pose";
import { aPose } from "./pose.fixture";
import { keyOf, keyOfImage, ReviewSession } from "./session";
import type { GradeDecision } from "./verdicts";

let made = 0;

function sessionOf(poses: readonly Pose[]): ReviewSession {
  const session = new ReviewSession();
  session.take(poses, ({ review }) => review === null);
  const graded = poses.filter(({ review }) => review !== null).length;
  session.setExtent("pose", poses.length, graded);
  return session;
}

/** Poses 1 and 2 on image 10, 3 on image 11, 4 and 5 on image 12. */
function harbour(graded: Partial<Record<number, Grade>> = {}): ReviewSession {
  const imageOf = [10, 10, 11, 12, 12];
  return sessionOf(
    imageOf.map((imageId, i) => aPose({ id: i + 1, imageId, grade: graded[i + 1] ?? null })),
  );
}

function verdict(grade: Grade, ...poseIds: number[]): GradeDecision {
  made += 1;
  return { kind: "grade", id: `d${made}`, imageId: 10, poseIds, grade, reasons: [] };
}

/** Grades what is shown, as a key does. */
function grade(session: ReviewSession, value: Grade): GradeDecision {
  const decision = verdict(value, session.current?.pose?.id ?? 0);
  session.decide(decision);
  return decision;
}

function at(session: ReviewSession): string | undefined {
  return session.current?.key;
}

describe("grading", () => {
  it("holds the grade at once and moves to the next that is due", () => {
    const session = harbour({ 2: "good" });
    grade(session, "ok");
    expect(session.gradeOf(1)).toBe("ok");
    expect(at(session)).toBe("pose:3");
    expect([session.done, session.total]).toEqual([2, 5]);
  });

  it("comes around to what was passed over, and rests once nothing is left", () => {
    const session = harbour({ 1: "good", 2: "good" });
    session.goTo(keyOf(5));
    grade(session, "bad");
    expect(at(session)).toBe("pose:3");
    grade(session, "good");
    expect(session.resting).toBe(false);
    grade(session, "wrong");
    expect([at(session), session.resting, session.done]).toEqual(["pose:4", true, 5]);
    session.goTo(keyOf(3));
    expect(session.resting).toBe(false);
  });

  it("counts a pose once however often it is graded", () => {
    const session = harbour();
    grade(session, "good");
    session.goTo(keyOf(1));
    grade(session, "bad");
    expect(session.done).toBe(1);
    expect(session.strip.map(({ key }) => key)).toEqual(["pose:1"]);
  });

  it("keeps the last ten decisions, newest first", () => {
    const session = sessionOf(
      Array.from({ length: 12 }, (_, i) => aPose({ id: i + 1, imageId: 1 })),
    );
    for (let i = 0; i < 12; i += 1) {
      grade(session, "good");
    }
    const ids = session.strip.map(({ key }) => Number(key.slice(5)));
    expect(ids).toEqual([12, 11, 10, 9, 8, 7, 6, 5, 4, 3]);
  });

  it("grades the rest of an image as one decision", () => {
    const session = harbour({ 1: "ok" });
    expect(session.ungradedOfImage(12).map(({ id }) => id)).toEqual([4, 5]);
    const decision = verdict("good", 4, 5);
    session.decide(decision);
    expect([session.gradeOf(4), session.gradeOf(5), session.done]).toEqual(["good", "good", 3]);
    session.withdraw(decision.id);
    expect([session.gradeOf(4), session.gradeOf(5), session.done]).toEqual([null, null, 1]);
  });
});

describe("undoing", () => {
  it("takes decisions back one after the other, the newest first", () => {
    const session = harbour();
    grade(session, "good");
    grade(session, "ok");
    const undone: (string | undefined)[] = [];
    for (let last = session.verdicts.last; last !== null; last = session.verdicts.last) {
      session.withdraw(last.id);
      undone.push(last.kind === "grade" ? last.grade : last.kind);
    }
    expect(undone).toEqual(["ok", "good"]);
    expect([session.done, session.gradeOf(1), session.gradeOf(2)]).toEqual([0, null, null]);
  });

  it("brings the grade before the second thought back", () => {
    const session = harbour();
    grade(session, "good");
    session.goTo(keyOf(1));
    const { id } = grade(session, "bad");
    session.withdraw(id);
    expect([session.gradeOf(1), session.done]).toEqual(["good", 1]);
  });

  it("makes what another sitting decided due again, whatever an older list says", () => {
    const session = harbour({ 1: "good" });
    session.verdicts.recall([{ ...verdict("good", 1), id: "decision-1" }]);
    expect(session.withdraw("decision-1")).not.toBeNull();
    expect(session.gradeOf(1)).toBeNull();
    session.take([aPose({ id: 1, imageId: 10, grade: "good" })], () => false);
    expect(session.gradeOf(1)).toBeNull();
    expect(session.isOpen("pose:1")).toBe(true);
  });

  it("forgets a remembered decision when the server asks for the pose again", () => {
    const session = new ReviewSession();
    session.verdicts.recall([verdict("good", 7)]);
    session.take([aPose({ id: 7, imageId: 1 })], () => true);
    expect([session.isOpen("pose:7"), session.gradeOf(7)]).toEqual([true, null]);
  });
});

describe("images", () => {
  it("stand behind their poses, are due until complete, and may have no pose at all", () => {
    const session = harbour();
    const { image } = aPose({ id: 1, imageId: 10 });
    session.takeImage(image, true);
    session.takeImage({ ...image, id: 99, captured_at: "2026-11-22T09:00:00Z" }, true);
    session.goTo(keyOf(1));
    session.sortByTime();
    expect(at(session)).toBe("pose:1");
    session.step(-1);
    expect(at(session)).toBe("image:99");
    session.decide({ kind: "complete", id: "c1", imageId: 99 });
    expect(at(session)).toBe("pose:1");
    grade(session, "good");
    grade(session, "good");
    expect(at(session)).toBe("image:10");
    session.withdraw("c1");
    expect([session.isOpen("image:99"), session.isOpen("image:10")]).toEqual([true, true]);
  });

  it("are not due once somebody has marked them complete", () => {
    const session = harbour();
    const { image } = aPose({ id: 1, imageId: 10 });
    session.takeImage(image, true);
    session.verdicts.tellComplete(10, true);
    expect(session.isOpen(keyOfImage(10))).toBe(false);
  });
});

it("counts the units of the queue only, and what is still on its way to the server", () => {
  const session = harbour();
  const { image } = aPose({ id: 1, imageId: 10 });
  session.takeImage(image, true);
  session.setExtent("image", 3, 1);
  grade(session, "good");
  expect(session.done).toBe(1);
  session.decide({ kind: "complete", id: "c2", imageId: 10 });
  const waiting = { kind: "complete", id: "c3", imageId: 55 } as const;
  session.verdicts.decide(waiting);
  session.count(waiting);
  expect(session.done).toBe(3);
});

describe("moving", () => {
  it("steps over boxes and stays at both ends", () => {
    const session = harbour();
    session.step(-1);
    expect(at(session)).toBe("pose:1");
    session.step(1);
    session.step(1);
    expect(at(session)).toBe("pose:3");
    session.goTo(keyOf(5));
    session.step(1);
    expect(at(session)).toBe("pose:5");
  });

  it("steps over images to their first box", () => {
    const session = harbour();
    session.goTo(keyOf(5));
    const seen = [-1, -1, -1, 1, 1, 1].map((by) => {
      session.stepImage(by === 1 ? 1 : -1);
      return at(session);
    });
    expect(seen).toEqual(["pose:3", "pose:1", "pose:1", "pose:3", "pose:4", "pose:4"]);
  });

  it("tells what comes next, around the end, without what is done", () => {
    const session = harbour({ 5: "good" });
    session.goTo(keyOf(3));
    expect(session.upcoming(9).map(({ key }) => key)).toEqual([
      "pose:4",
      "pose:1",
      "pose:2",
      "pose:3",
    ]);
    expect(session.upcoming(2).map(({ key }) => key)).toEqual(["pose:4", "pose:1"]);
  });

  it("begins with the first that is due, and rests once all are graded", () => {
    const session = harbour({ 1: "good", 2: "ok" });
    expect([session.toFirstDue(), at(session)]).toEqual([true, "pose:3"]);
    const done = harbour({ 1: "good", 2: "ok", 3: "ok", 4: "bad", 5: "good" });
    expect([done.toFirstDue(), at(done), done.resting]).toEqual([false, "pose:1", true]);
  });

  it("shows poses that are somebody else's, but never leads to them by itself", () => {
    const session = harbour();
    session.take([aPose({ id: 6, imageId: 10 })], () => false);
    expect(session.posesOfImage(10).map(({ id }) => id)).toEqual([1, 2, 6]);
    expect(session.upcoming(9).map(({ key }) => key)).not.toContain("pose:6");
    expect(session.goTo(keyOf(6))).toBe(true);
  });

  it("gives another list of an image's poses whenever one of them changed, else the same", () => {
    const session = harbour();
    const before = session.posesOfImage(10);
    expect(session.posesOfImage(10)).toBe(before);
    session.take([aPose({ id: 1, imageId: 10 })], () => true);
    expect(session.posesOfImage(10)).not.toBe(before);
    expect(session.posesOfImage(10)).toHaveLength(2);
  });

  it("keeps the verdicts of others to itself in a double review", () => {
    const session = new ReviewSession();
    session.isBlind = true;
    session.take([aPose({ id: 1, imageId: 10, grade: "bad" })], () => true);
    expect(session.gradeOf(1)).toBeNull();
  });

  it("is empty without poses, and says so instead of failing", () => {
    const session = new ReviewSession();
    session.step(1);
    session.stepImage(1);
    expect([session.current, session.toNextDue(), session.toFirstDue()]).toEqual([
      null,
      false,
      false,
    ]);
  });
});
