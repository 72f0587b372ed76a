// Summary, verdict and events of a simulation in the page, worded as for a recorded run.

/** Return the header fields that a recorded run has, for a simulated one: summary, verdict, events, status. */
function outcomeOf(data, result, run, failure) {
  const { first_inside: firstInside, last_entered: lastEntered, inside, failed_step: refused } = result.metrics;
  const end = refused >= 0 ? refused : (run.end - run.start) / data.step;
  const settled = inside > 0 && (end - lastEntered) * data.step >= data.settled_for;
  const clearances = run.header.regions.slice(1).map(({ name }) => {
    return [name, run.column(`${name}.clearance`).reduce((a, b) => (b < a ? b : a), Infinity)];
  });
  const summary = {
    reach_time: firstInside >= 0 ? firstInside * data.step : null,
    settle_time: settled ? lastEntered * data.step : null,
    min_clearance: Object.fromEntries(clearances),
  };
  const [verdict, events] = [verdictOf(result, run, summary), eventsOf(run, summary, failure)];
  return { summary, verdict, events, status: "completed" };
}

function verdictOf({ metrics, message }, run, { reach_time: reach, settle_time: settled, min_clearance: clearances }) {
  const [goal, ...regions] = run.header.regions;
  const [goals, goalIndex, closest] = [goal.places?.length ?? 1, run.goalPlace(run.end), -metrics.goal_clearance];
  const unknown = "how near it came is not recorded";
  const near = Number.isFinite(closest) ? `it came within ${decimals(closest, 2)} m of it` : unknown;
  const entered = `The vehicle entered the goal region at ${decimals(reach, 2)} s`;
  let words = `The vehicle never entered the goal region; ${near}`;
  if (settled !== null && settled === reach) words = `${entered} and stayed`;
  else if (settled !== null) words = `${entered} and stayed inside from ${decimals(settled, 2)} s`;
  else if (reach !== null) words = `${entered} but did not settle there`;
  else if (goalIndex < goals - 1) words = `The vehicle reached ${goalIndex} of ${goals} goals in turn`;
  const broken = regions.filter(({ name }) => clearances[name] < 0).map(({ name, unit, hard }) => {
    const depth = unit === "rad" ? `${decimals(-clearances[name] * DEGREES, 1)}°` : `${decimals(-clearances[name], 3)} m`;
    return `${name} by ${depth}${hard ? "" : " (soft)"}`;
  });
  const regionText = broken.length ? `violated ${broken.join(", ")}` : "kept every region";
  const stopped = ` The flight ended before its time: ${message || "the plant refused a step"}.`;
  return `${words}; it ${regionText}.${metrics.failed_step >= 0 ? stopped : ""}`;
}

/** Return an event for the first row within the goal at each of its places. */
function arrivalsOf(run) {
  const [goal] = run.header.regions;
  const [place, clearance] = ["goal.place", "goal.clearance"].map((name) => run.column(name));
  return (goal.stops ?? []).flatMap((name, stop) => {
    const row = run.time.findIndex((_, i) => place[i] === stop && clearance[i] >= 0);
    return row < 0 ? [] : [{ time: run.time[row], kind: "goal", text: `Reaches ${name} of the goal` }];
  });
}

function eventsOf(run, { reach_time: reach }, failure) {
  const { regions } = run.header;
  const violations = regions.slice(1).flatMap(({ name, unit }) => {
    const text = `Violates ${name}${unit === "rad" ? "'s angle" : ""}`;
    const times = below(run, `${name}.clearance`).slice(0, 5);
    return times.map(([time, until]) => ({ time, until, kind: "violation", text }));
  });
  const changes = stretches(run.column("active")).slice(1).map(({ from, value }) => {
    const { name, criterion } = regions[value];
    const text = criterion ? `Gives way to ${name} (${criterion})` : "Goes for the goal again";
    return { time: run.time[from], kind: "active", text };
  });
  const events = [
    ...(failure ? [{ time: failure.time, kind: "failure", text: `Thruster ${failure.thruster} fails` }] : []),
    ...arrivalsOf(run),
    ...(reach !== null ? [{ time: reach, kind: "goal", text: "Enters the goal region" }] : []),
    ...violations,
    ...changes,
  ];
  return events.slice(0, Math.max(60, events.length - changes.length)).sort((a, b) => a.time - b.time);
}
