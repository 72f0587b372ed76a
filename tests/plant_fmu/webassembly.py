"""An importer of fmi-ls-wasm with wasmtime, which shares no code with what is built."""

import wasmtime
from wasmtime import component as model

MEMORY = 24 << 20  # bytes that an instance may have; it begins with 16 MiB
PACKAGE = "fmi:fmi3/{}@3.0.0"


class RefusedError(Exception):
    """A status that is no success."""


class ComponentInstance:
    """An instance behind one interface, `co-simulation` or `model-exchange`; `said` collects what it logs."""

    def __init__(self, data, interface, token, name="test", logging_on=False):
        self.said = []
        engine = wasmtime.Engine()
        self.store = wasmtime.Store(engine)
        self.store.set_limits(memory_size=MEMORY)
        component = model.Component(engine, data)
        linker = model.Linker(engine)
        with linker.root() as root, root.add_instance(PACKAGE.format("callbacks")) as callbacks:
            callbacks.add_func("log-message", lambda _, *said: self.said.append(said))
            for other in ("clock-update", "lock-preemption", "unlock-preemption"):
                callbacks.add_func(other, lambda _: None)
        self.instance = linker.instantiate(self.store, component)
        self.interface, self.functions = interface, {}
        text = (name, token, "", False, logging_on)
        more = (False, False, []) if interface == "co-simulation" else ()
        self.resource = self._function(f"[static]{interface}-instance.instantiate-{interface}")(
            self.store, *text, *more
        )

    def _function(self, name, interface=None):
        key = (name, interface or self.interface)
        if key not in self.functions:
            within = self.instance.get_export_index(self.store, PACKAGE.format(key[1]))
            self.functions[key] = self.instance.get_func(
                self.store, self.instance.get_export_index(self.store, name, within)
            )
        return self.functions[key]

    def version(self):
        return self._function("get-version", "common")(self.store)

    def call(self, method, *arguments):
        """Return what a method returns; raise RefusedError with the status where that is no success."""
        found = self._function(f"[method]{self.interface}-instance.{method}")(self.store, self.resource, *arguments)
        if isinstance(found, str) and found not in ("ok", "warning"):
            raise RefusedError(found)
        if isinstance(found, model.Variant):
            if found.tag == "err":
                raise RefusedError(found.payload)
            return found.payload
        return found

    def drop(self):
        self.resource.drop(self.store)
