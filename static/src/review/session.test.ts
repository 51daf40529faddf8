import { describe, expect, it } from "vitest";
import type { Grade, Pose } from "./pose";
import { ReviewSession } from "./session";
import { aPose } from "./pose.fixture";

function sessionOf(...poses: Pose[]): ReviewSession {
  const session = new ReviewSession();
  session.append(poses);
  return session;
}

/** Poses 1 and 2 on image 10, 3 on image 11, 4 and 5 on image 12. */
function harbour(graded: Partial<Record<number, Grade>> = {}): ReviewSession {
  const imageOf = [10, 10, 11, 12, 12];
  return sessionOf(
    ...imageOf.map((imageId, i) => aPose({ id: i + 1, imageId, grade: graded[i + 1] ?? null })),
  );
}

describe("grading", () => {
  it("holds the grade at once and moves to the next ungraded pose", () => {
    const session = harbour({ 2: "good" });
    expect(session.grade("ok")?.id).toBe(1);
    expect(session.gradeOf(1)).toBe("ok");
    expect(session.current?.id).toBe(3);
    expect([session.graded, session.total]).toEqual([2, 5]);
  });

  it("comes around to what was passed over, and stays once nothing is left", () => {
    const session = harbour({ 1: "good", 2: "good" });
    session.goTo(5);
    session.grade("bad");
    expect(session.current?.id).toBe(3);
    session.grade("good");
    session.grade("wrong");
    expect(session.current?.id).toBe(4);
    expect(session.toNextUngraded()).toBe(false);
    expect(session.graded).toBe(5);
  });

  it("counts a pose once however often it is graded", () => {
    const session = harbour();
    session.grade("good");
    session.goTo(1);
    session.grade("bad");
    expect(session.graded).toBe(1);
    expect(session.strip).toEqual([{ poseId: 1, grade: "bad" }]);
  });

  it("falls back to what the server knew when a grade is refused", () => {
    const session = harbour({ 1: "good" });
    session.goTo(1);
    session.grade("bad");
    session.grade("ok");
    session.withdraw(1);
    session.withdraw(2);
    expect(session.gradeOf(1)).toBe("good");
    expect(session.gradeOf(2)).toBeNull();
    expect(session.graded).toBe(1);
    expect(session.strip).toEqual([]);
  });

  it("falls back to the last grade that the server stored, not to the one before", () => {
    const session = harbour();
    session.grade("good");
    session.acknowledge(1, "good");
    session.goTo(1);
    session.grade("bad");
    session.withdraw(1);
    expect(session.gradeOf(1)).toBe("good");
  });

  it("believes an answer to a grade over a list that was asked for before", () => {
    const session = new ReviewSession();
    session.acknowledge(2, "ok");
    session.append([aPose({ id: 1, imageId: 1 }), aPose({ id: 2, imageId: 1 })]);
    expect(session.gradeOf(2)).toBe("ok");
    expect(session.graded).toBe(1);
  });

  it("keeps the last ten decisions, newest first", () => {
    const session = sessionOf(
      ...Array.from({ length: 12 }, (_, i) => aPose({ id: i + 1, imageId: 1 })),
    );
    for (let i = 0; i < 12; i += 1) {
      session.grade("good");
    }
    expect(session.strip.map(({ poseId }) => poseId)).toEqual([12, 11, 10, 9, 8, 7, 6, 5, 4, 3]);
  });
});

describe("going back", () => {
  it("reopens the last decision, then the one before, and stops at the first", () => {
    const session = harbour();
    session.grade("good");
    session.grade("good");
    session.grade("good");
    expect([session.back()?.id, session.back()?.id, session.back()?.id]).toEqual([3, 2, 1]);
    expect(session.back()).toBeNull();
    expect(session.current?.id).toBe(1);
  });

  it("returns to the work after the second thought", () => {
    const session = harbour();
    session.grade("good");
    session.grade("good");
    session.back();
    session.grade("bad");
    expect(session.current?.id).toBe(3);
    expect(session.back()?.id).toBe(2);
  });

  it("has nowhere to go before the first decision", () => {
    expect(harbour().back()).toBeNull();
  });
});

describe("moving", () => {
  it("steps over boxes and stays at both ends", () => {
    const session = harbour();
    session.step(-1);
    expect(session.current?.id).toBe(1);
    session.step(1);
    session.step(1);
    expect(session.current?.id).toBe(3);
    session.goTo(5);
    session.step(1);
    expect(session.current?.id).toBe(5);
  });

  it("steps over images to their first box", () => {
    const session = harbour();
    session.goTo(5);
    session.stepImage(-1);
    expect(session.current?.id).toBe(3);
    session.stepImage(-1);
    expect(session.current?.id).toBe(1);
    session.stepImage(-1);
    expect(session.current?.id).toBe(1);
    session.stepImage(1);
    session.stepImage(1);
    expect(session.current?.id).toBe(4);
    session.stepImage(1);
    expect(session.current?.id).toBe(4);
  });

  it("tells which poses come next, around the end, without the graded and the current", () => {
    const session = harbour({ 5: "good" });
    session.goTo(3);
    expect(session.upcoming(9).map(({ id }) => id)).toEqual([4, 1, 2, 3]);
    expect(session.upcoming(2).map(({ id }) => id)).toEqual([4, 1]);
  });

  it("begins with the first ungraded pose, and with the very first once all are graded", () => {
    const session = harbour({ 1: "good", 2: "ok" });
    expect([session.toFirstUngraded(), session.current?.id]).toEqual([true, 3]);
    const done = harbour({ 1: "good", 2: "ok", 3: "ok", 4: "bad", 5: "good" });
    expect([done.toFirstUngraded(), done.current?.id]).toEqual([false, 1]);
  });

  it("numbers the images", () => {
    const session = harbour();
    session.goTo(3);
    expect(session.imagePosition()).toEqual({ number: 2, count: 3 });
  });

  it("passes over poses that it has already, as overlapping pages bring them", () => {
    const session = harbour();
    session.append([aPose({ id: 5, imageId: 12 }), aPose({ id: 6, imageId: 13, grade: "ok" })]);
    expect([session.total, session.graded]).toEqual([6, 1]);
  });

  it("is empty without poses, and says so instead of failing", () => {
    const session = new ReviewSession();
    expect(session.current).toBeNull();
    expect(session.grade("good")).toBeNull();
    session.step(1);
    session.stepImage(1);
    expect(session.toNextUngraded()).toBe(false);
  });
});
