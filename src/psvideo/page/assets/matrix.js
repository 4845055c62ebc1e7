// From the world's axes back to the camera's.

export const SAME = [1, 0, 0, 0, 1, 0, 0, 0, 1];

// The rotation from the frame that a picture's vectors are in to the camera's, row by row, and the camera's place there.
export function toCameraOf(facts) {
  const given = facts?.camera_to_world;
  if (!given) return { toCamera: SAME, origin: [0, 0, 0] };
  const at = (row, col) => given[4 * row + col];
  const toCamera = [0, 1, 2].flatMap((row) => [0, 1, 2].map((col) => at(col, row)));
  return { toCamera, origin: [at(0, 3), at(1, 3), at(2, 3)] };
}

export function product(matrix, vector) {
  return [0, 3, 6].map((row) => matrix[row] * vector[0] + matrix[row + 1] * vector[1] + matrix[row + 2] * vector[2]);
}
