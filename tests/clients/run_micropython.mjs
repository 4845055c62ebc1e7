// Run a file under MicroPython, with as much memory as it has on a Pico, and print what it prints.
import { readFileSync } from "node:fs";
import { loadMicroPython } from "@micropython/micropython-webassembly-pyscript";

const PICO_HEAP = 192 * 1024;

const python = await loadMicroPython({ heapsize: PICO_HEAP, linebuffer: true, stdout: (line) => console.log(line) });
python.runPython(readFileSync(process.argv[2], "utf-8"));
