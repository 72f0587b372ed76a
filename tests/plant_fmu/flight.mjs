// The same flight in the module alone: node flight.mjs module.wasm flight.json written.bin
import fs from "node:fs"

const [file, plan, out] = process.argv.slice(2)
const flight = JSON.parse(fs.readFileSync(plan))
const { exports: fmu } = (await WebAssembly.instantiate(fs.readFileSync(file), {})).instance
fmu._initialize()

const put = (array) => {
  const address = fmu.malloc(array.byteLength)
  new Uint8Array(fmu.memory.buffer).set(new Uint8Array(array.buffer, array.byteOffset, array.byteLength), address)
  return address
}
const text = (string) => put(new TextEncoder().encode(string + "\0"))
const need = (status) => {
  if (status !== 0) throw new Error(`status ${status}`)
}
const set = (instance, references, values) => {
  const [r, v] = [put(new Uint32Array(references)), put(new Float64Array(values))]
  need(fmu.fmi3SetFloat64(instance, r, references.length, v, values.length))
  fmu.free(r), fmu.free(v)
}

const instance = fmu.fmi3InstantiateCoSimulation(text("node"), text(flight.token), 0, 0, 0, 0, 0, 0, 0, 0, 0, 0)
set(instance, flight.start, flight.values)
need(fmu.fmi3EnterInitializationMode(instance, 0, 0, 0, 0, 0))
need(fmu.fmi3ExitInitializationMode(instance))
set(instance, flight.forced, flight.forces)

const n = flight.outputs.length
const [references, values, flags] = [put(new Uint32Array(flight.outputs)), fmu.malloc(8 * n), fmu.malloc(24)]
const got = new Float64Array(flight.steps * n)
const begin = performance.now()
for (let i = 0; i < flight.steps; i++) {
  need(fmu.fmi3DoStep(instance, i * flight.step, flight.step, 1, flags, flags + 4, flags + 8, flags + 16))
  need(fmu.fmi3GetFloat64(instance, references, n, values, n))
  got.set(new Float64Array(fmu.memory.buffer, values, n), i * n)
}
console.log(`${(performance.now() - begin).toFixed(1)} ms`)
fmu.fmi3FreeInstance(instance)
fs.writeFileSync(out, new Uint8Array(got.buffer))
