// Summary, verdict and events of a simulation in the page, worded as for a recorded run.

/** Return the header fields that a recorded run has, for a simulated one: summary, verdict, events, status. */
function outcomeOf(data, result, run, failure) {
  const { header } = run;
  const [firstInside, lastEntered, inside] = result.metrics;
  const end = result.metrics[12] >= 0 ? result.metrics[12] : (run.end - run.start) / data.step;
  const settled = inside > 0 && (end - lastEntered) * data.step >= data.settled_for;
  const reach = firstInside >= 0 ? firstInside * data.step : null;
  const least = Object.fromEntries(header.regions.slice(1).map(({ name }) => [name, run.column(`${name}.clearance`).reduce((a, b) => (b < a ? b : a), Infinity)]));
  const summary = { reach_time: reach, settle_time: settled ? lastEntered * data.step : null, min_clearance: least };
  return { summary, verdict: verdictOf(result, run, summary), events: eventsOf(run, summary, failure), status: "completed" };
}

function verdictOf(result, run, { reach_time: reach, settle_time: settled, min_clearance: least }) {
  const closest = -result.metrics[5];
  const [goals, at] = [run.header.regions[0].places?.length ?? 1, run.goalPlace(run.end)];
  const entered = `The vehicle entered the goal region at ${decimals(reach, 2)} s`;
  let goal = `The vehicle never entered the goal region; ${Number.isFinite(closest) ? `it came within ${decimals(closest, 2)} m of it` : "how near it came is not recorded"}`;
  if (settled !== null) goal = `${entered} ${settled === reach ? "and stayed" : `and was in for good from ${decimals(settled, 2)} s`}`;
  else if (reach !== null) goal = `${entered} but did not settle there`;
  else if (at < goals - 1) goal = `The vehicle reached ${at} of ${goals} goals in turn`;
  const broken = run.header.regions.slice(1).filter(({ name }) => least[name] < 0);
  const depth = ({ name, unit }) => (unit === "rad" ? `${decimals(-least[name] * DEGREES, 1)}°` : `${decimals(-least[name], 3)} m`);
  const kept = broken.length ? `violated ${broken.map((region) => `${region.name} by ${depth(region)}${region.hard ? "" : " (soft)"}`).join(", ")}` : "kept every region";
  const stopped = result.metrics[12] >= 0 ? ` The flight ended before its time: ${result.said || "the plant refused a step"}.` : "";
  return `${goal}; it ${kept}.${stopped}`;
}

function eventsOf(run, { reach_time: reach }, failure) {
  const events = failure ? [{ time: failure.time, kind: "failure", text: `Thruster ${failure.thruster} fails` }] : [];
  if (reach !== null) events.push({ time: reach, kind: "goal", text: "Enters the goal region" });
  for (const { name, unit } of run.header.regions.slice(1)) {
    for (const [from, until] of below(run, `${name}.clearance`).slice(0, 5)) {
      events.push({ time: from, until, kind: "violation", text: `Violates ${name}${unit === "rad" ? "'s angle" : ""}` });
    }
  }
  const active = run.column("active");
  for (let i = 1; i < run.rows && events.length < 60; i++) {
    if (active[i] === active[i - 1]) continue;
    const { name, criterion } = run.header.regions[active[i]];
    events.push({ time: run.time[i], kind: "active", text: criterion ? `Gives way to ${name} (${criterion})` : "Goes for the goal again" });
  }
  return events.sort((a, b) => a.time - b.time);
}
