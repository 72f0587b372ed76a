// Web worker that runs the scenario's WebAssembly: it sets the inputs, simulates, and returns the results.

let flight = null; // exports of the module

/** Write numbers into an array of the module: [[index, value], ...]. */
function put(array, numbers) {
  for (const [place, value] of numbers) array[place] = value;
}

/** Return a copy of `count` numbers at an address of the module. */
function copied(address, count) {
  return new Float64Array(flight.memory.buffer, address, count).slice();
}

/** Return the last message of the plant. */
function said() {
  const bytes = new Uint8Array(flight.memory.buffer, flight.message(), 512);
  return new TextDecoder().decode(bytes.slice(0, bytes.indexOf(0)));
}

/** Simulate one flight and return its results. */
function flown({ numbers, integers, gains, starts, noise, sizes, metrics }) {
  if (!flight.begin()) throw new Error(said());
  put(new Float64Array(flight.memory.buffer, flight.numbers()), numbers);
  put(new BigInt64Array(flight.memory.buffer, flight.integers()), integers.map(([place, value]) => [place, BigInt(value)]));
  put(new Float64Array(flight.memory.buffer, flight.gains()), gains);
  for (const [reference, value] of starts) if (!flight.set_start(reference, value)) throw new Error(said());
  const began = performance.now();
  if (!flight.fly(...noise)) throw new Error(said());
  const took = performance.now() - began;
  const result = { took, said: said(), metrics: copied(flight.numbers() + 8 * metrics[0], metrics[1]) };
  for (const [name, size] of Object.entries(sizes)) result[name] = copied({ trace: flight.trace, reasons: flight.reasons, rules: flight.strengths }[name](), size);
  return result;
}

self.onmessage = async ({ data }) => {
  try {
    if (data.module) {
      flight = (await WebAssembly.instantiate(data.module, {})).instance.exports;
      flight._initialize();
      self.postMessage({ ready: true });
    } else {
      const result = flown(data);
      self.postMessage(result, ["trace", "reasons", "rules"].map((name) => result[name].buffer));
    }
  } catch (error) {
    self.postMessage({ refused: error.message || "the flight was refused" });
  }
};
