// The scripts of an interactive replay, without a page: node fly.mjs assets job.json out
// The job has the page's data, the header of its run, and the values and the failure that a reader gives.
import fs from "node:fs"

const [assets, file, out] = process.argv.slice(2)
const job = JSON.parse(fs.readFileSync(file))
const text = (name) => fs.readFileSync(`${assets}/${name}`, "utf8")

globalThis.document = { getElementById: () => ({ textContent: text("flight_worker.js") }) }
globalThis.Worker = class {
  constructor() {
    this.self = { postMessage: (data) => this.onmessage({ data }) }
    new Function("self", text("flight_worker.js"))(this.self)
  }
  postMessage(data) {
    this.self.onmessage({ data })
  }
}
const names = ["Run", "Flight", "runOfFlight", "outcomeOf", "scenarioText"]
const scripts = ["data.js", "words.js", "flight.js", "outcome.js", "saving.js"].map(text).join("\n")
const { Flight, runOfFlight, outcomeOf, scenarioText } = new Function(`${scripts}; return { ${names.join(", ")} }`)()

const flight = new Flight(job.data)
await flight.start()
const values = new Map(Object.entries(job.values))
const result = await flight.fly(values, job.failure)
if (result.refused) {
  fs.writeFileSync(`${out}.json`, JSON.stringify({ refused: result.refused }))
  process.exit(0)
}
const run = runOfFlight({ ...job.data }, result, job.header)
const signals = run.header.signals.map(({ name }) => name)
const whatIf = { flight, values, failure: job.failure, value: (key) => values.get(key) ?? flight.slots.get(key).value, words: () => ["as a test has it"] }
const { verdict, summary, events } = outcomeOf(job.data, result, run, job.failure)
fs.writeFileSync(`${out}.json`, JSON.stringify({ signals, rows: run.rows, verdict, summary, events, toml: scenarioText(whatIf), took: result.took }))
fs.writeFileSync(`${out}.bin`, Buffer.concat(signals.map((name) => Buffer.from(run.column(name).slice().buffer))))
