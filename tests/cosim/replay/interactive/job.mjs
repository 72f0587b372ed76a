// What a page asks of its worker for other numbers, without a flight: node job.mjs assets job.json
// The job has the page's data, and the values and the failure that a reader gives.
import fs from "node:fs"

const [assets, file] = process.argv.slice(2)
const { data, values, failure } = JSON.parse(fs.readFileSync(file))

globalThis.document = { getElementById: () => ({ textContent: "" }) }
globalThis.Worker = class {
  postMessage(asked) {
    this.onmessage({ data: asked.module ? { ready: true } : asked })
  }
}
const scripts = ["data.js", "flight.js"].map((name) => fs.readFileSync(`${assets}/${name}`, "utf8"))
const flight = new (new Function(`${scripts.join("\n")}; return Flight`)())(data)
await flight.start()
console.log(JSON.stringify(await flight.fly(new Map(Object.entries(values)), failure)))
