// Web worker that runs the scenario's WebAssembly: it sets the inputs, simulates, and returns the results.

let flight = null; // exports of the module

/** Write numbers into an array of the module: [[index, value], ...]. */
function put(Type, address, numbers) {
  const array = new Type(flight.memory.buffer, address);
  for (const [index, value] of numbers) array[index] = value;
}

/** Return the last message of the plant. */
function lastMessage() {
  const bytes = new Uint8Array(flight.memory.buffer, flight.message(), 512);
  return new TextDecoder().decode(bytes.slice(0, bytes.indexOf(0)));
}

/** Throw the last message of the plant if it has refused. */
function check(ok) {
  if (!ok) throw new Error(lastMessage());
}

/** Simulate one flight and return its results. */
function simulate({ numbers, integers, gains, starts, noise, metrics, size }) {
  check(flight.begin());
  put(Float64Array, flight.numbers(), numbers);
  put(BigInt64Array, flight.integers(), integers.map(([index, value]) => [index, BigInt(value)]));
  put(Float64Array, flight.gains(), gains);
  for (const [reference, value] of starts) check(flight.set_start(reference, value));
  const began = performance.now();
  check(flight.fly(...noise));
  const took = performance.now() - began;
  const numbersNow = new Float64Array(flight.memory.buffer, flight.numbers());
  return {
    took,
    message: lastMessage(),
    metrics: Object.fromEntries(Object.entries(metrics).map(([name, index]) => [name, numbersNow[index]])),
    rows: new Float64Array(flight.memory.buffer, flight.rows(), size).slice(),
  };
}

self.onmessage = async ({ data }) => {
  try {
    if (data.module) {
      flight = (await WebAssembly.instantiate(data.module, {})).instance.exports;
      flight._initialize();
      self.postMessage({ ready: true });
    } else {
      const result = simulate(data);
      self.postMessage(result, [result.rows.buffer]);
    }
  } catch (error) {
    self.postMessage({ refused: error.message || "the flight was refused" });
  }
};
