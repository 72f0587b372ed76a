"""The interfaces of the draft layered standard fmi-ls-wasm, in WIT, the Component Model's language of interfaces."""

from __future__ import annotations

# as of commit c1aac17 of 2026-07-08; the draft has no version of its own yet, 0.1.0 is the example that its text gives
DRAFT = "0.1.0"
FOLDER = "extra/org.modelica.fmi-ls-wasm"
PLATFORM = "wasm32-wasip2"  # folder below binaries/

_NUMBERS = {
    "float32": "f32", "float64": "f64", "int8": "s8", "int16": "s16", "int32": "s32", "int64": "s64",
    "uint8": "u8", "uint16": "u16", "uint32": "u32", "uint64": "u64",
    "boolean": "bool", "string": "string", "binary": "list<u8>", "clock": "bool",
}  # fmt: skip

_TYPES = """\
interface types {
  type value-reference = u32;
  enum status { ok, warning, discard, error, fatal }
  enum interval-qualifier { interval-not-yet-known, interval-unchanged, interval-changed }
  enum dependency-kind { dependent, constant, fixed, tunable, discrete }
  type fmu-state = list<u8>;
  record interval-fraction { counter: u64, resolution: u64 }
  record variable-dependency {
    dependent-value-reference: value-reference, element-index-of-dependent: u32,
    independent-value-reference: value-reference, element-index-of-independent: u32,
    kind: dependency-kind,
  }
  record discrete-states-info {
    new-discrete-states-needed: bool, terminate-simulation: bool,
    nominals-of-continuous-states-changed: bool, values-of-continuous-states-changed: bool,
    next-event-time-defined: bool, next-event-time: f64,
  }
}

interface callbacks {
  use types.{status};
  log-message: func(instance-name: string, status: status, category: string, message: string);
  clock-update: func();
  lock-preemption: func();
  unlock-preemption: func();
}

interface common {
  get-version: func() -> string;
}
"""

_METHODS = """\
    set-debug-logging: func(logging-on: bool, categories: list<string>) -> status;
    enter-initialization-mode: func(tolerance: option<f64>, start-time: f64, stop-time: option<f64>) -> status;
    exit-initialization-mode: func() -> status;
    enter-event-mode: func() -> status;
    update-discrete-states: func() -> result<discrete-states-info, status>;
    terminate: func() -> status;
    reset: func() -> status;
    enter-configuration-mode: func() -> status;
    exit-configuration-mode: func() -> status;
    get-number-of-variable-dependencies: func(vr: value-reference) -> result<u64, status>;
    get-variable-dependencies: func(dependent: value-reference) -> result<list<variable-dependency>, status>;
    get-fmu-state: func() -> result<fmu-state, status>;
    set-fmu-state: func(state: fmu-state) -> status;
    get-directional-derivative: func(unknowns: list<value-reference>, knowns: list<value-reference>, seed: list<f64>)
      -> result<list<f64>, status>;
    get-adjoint-derivative: func(unknowns: list<value-reference>, knowns: list<value-reference>, seed: list<f64>)
      -> result<list<f64>, status>;
    get-interval-decimal: func(value-references: list<value-reference>)
      -> result<list<tuple<f64, interval-qualifier>>, status>;
    get-interval-fraction: func(value-references: list<value-reference>)
      -> result<list<tuple<interval-fraction, interval-qualifier>>, status>;
    get-shift-decimal: func(value-references: list<value-reference>) -> result<list<f64>, status>;
    get-shift-fraction: func(value-references: list<value-reference>) -> result<list<interval-fraction>, status>;
    set-interval-decimal: func(value-references: list<value-reference>, intervals: list<f64>) -> status;
    set-interval-fraction: func(value-references: list<value-reference>, intervals: list<interval-fraction>) -> status;
    set-shift-decimal: func(value-references: list<value-reference>, shifts: list<f64>) -> status;
    set-shift-fraction: func(value-references: list<value-reference>, shifts: list<interval-fraction>) -> status;
    evaluate-discrete-states: func() -> status;
    get-output-derivatives: func(requests: list<tuple<value-reference, u32>>) -> result<list<f64>, status>;
    enter-step-mode: func() -> status;
"""

_CO_SIMULATION = """\
    instantiate-co-simulation: static func(
      instance-name: string, instantiation-token: string, resource-path: string, visible: bool, logging-on: bool,
      event-mode-used: bool, early-return-allowed: bool, required-intermediate-variables: list<value-reference>,
    ) -> option<co-simulation-instance>;
    set-input-derivatives: func(requests: list<tuple<value-reference, u32>>, values: list<f64>) -> status;
    do-step: func(
      current-communication-point: f64, communication-step-size: f64, no-set-fmu-state-prior-to-current-point: bool,
    ) -> result<do-step-result, status>;
"""
_DO_STEP = """\
  record do-step-result {
    last-successful-time: f64, event-handling-needed: bool, terminate-simulation: bool, early-return: bool,
  }
"""

_MODEL_EXCHANGE = """\
    instantiate-model-exchange: static func(
      instance-name: string, instantiation-token: string, resource-path: string, visible: bool, logging-on: bool,
    ) -> option<model-exchange-instance>;
    enter-continuous-time-mode: func() -> status;
    set-time: func(time: f64) -> status;
    set-continuous-states: func(continuous-states: list<f64>) -> status;
    get-continuous-state-derivatives: func() -> result<list<f64>, status>;
    get-event-indicators: func() -> result<list<f64>, status>;
    get-continuous-states: func() -> result<list<f64>, status>;
    get-nominals-of-continuous-states: func() -> result<list<f64>, status>;
    get-number-of-event-indicators: func() -> result<u64, status>;
    get-number-of-continuous-states: func() -> result<u64, status>;
    completed-integrator-step: func(no-set-fmu-state-prior-to-current-point: bool)
      -> result<completed-step-result, status>;
"""
_COMPLETED = "  record completed-step-result { enter-event-mode: bool, terminate-simulation: bool }\n"


def wit(model_exchange: bool) -> str:
    """Return the interfaces of a component, in WIT."""
    interfaces = {"co-simulation": (_DO_STEP, _CO_SIMULATION)}
    if model_exchange:
        interfaces["model-exchange"] = (_COMPLETED, _MODEL_EXCHANGE)
    text = ["package fmi:fmi3@3.0.0;\n", _TYPES]
    text += [_interface(name, records, methods) for name, (records, methods) in interfaces.items()]
    exports = "".join(f"  export {name};\n" for name in ("common", *interfaces))
    return "\n".join([*text, f"world fmu {{\n  import callbacks;\n{exports}}}\n"])


def _interface(name: str, records: str, methods: str) -> str:
    references = "value-references: list<value-reference>"
    variables = "".join(
        f"    get-{kind}: func({references}) -> result<list<{value}>, status>;\n"
        f"    set-{kind}: func({references}, values: list<{value}>) -> status;\n"
        for kind, value in _NUMBERS.items()
    )
    used = "value-reference, status, fmu-state, interval-qualifier, interval-fraction, variable-dependency"
    return (
        f"interface {name} {{\n  use types.{{{used}, discrete-states-info}};\n{records}"
        f"  resource {name}-instance {{\n{methods}{_METHODS}{variables}  }}\n}}\n"
    )
