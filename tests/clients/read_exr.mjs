// Read an EXR with three.js, as a page would, and write its floats (R, G, B, A, rows from the bottom) to a file.
// Arguments: the EXR, the file to write. Prints what three.js says of it as JSON.
import { readFileSync, writeFileSync } from "node:fs";
import { FloatType, NoColorSpace, REVISION } from "three";
import { EXRLoader } from "three/examples/jsm/loaders/EXRLoader.js";

const [, , exr, raw] = process.argv;
const bytes = readFileSync(exr);
const loader = new EXRLoader().setDataType(FloatType);
const read = loader.parse(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length));
writeFileSync(raw, Buffer.from(read.data.buffer, read.data.byteOffset, read.data.byteLength));
console.log(
    JSON.stringify({
        revision: REVISION,
        width: read.width,
        height: read.height,
        colorSpace: read.colorSpace ?? NoColorSpace,
    }),
);
