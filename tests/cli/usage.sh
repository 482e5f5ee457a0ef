# SPDX-License-Identifier: Apache-2.0
. "$(dirname "$0")/common.sh"

expect 0 --version
grep -q '^asbuilt [0-9]' stdout || fail "--version does not tell the version"
expect 0 --help
for verb in reconstruct prepare detect register inspect explain simulate evaluate info export live; do
  expect 0 "$verb" --help
  [ "$(grep -c "^  asbuilt $verb " stdout)" -eq 2 ] || fail "asbuilt $verb --help does not end with two examples"
done

expect 2
expect 2 no_such_verb
expect 2 reconstruct
expect 2 reconstruct model.stl scan.ply
expect 2 reconstruct model.stl scan.ply -o out --no-such-option
expect 2 reconstruct model.stl scan.ply -o out --unit parsec
expect 2 reconstruct model.stl scan.ply -o out --tolerance 1
says LOW,HIGH
expect 2 reconstruct model.stl scan.ply -o out --tolerance 0.5,-0.5
expect 2 reconstruct model.stl scan.ply -o out --threads -1
expect 2 detect model.stl scan.ply -o out --neighbour-bins 0
expect 2 reconstruct model.stl scan.ply -o out --mesh --mesh-cell -1
says mesh_cell
expect 2 detect model.stl scan.ply -o out --accept scan
says SCAN:CANDIDATE
absent out

# --config: every option of a verb, with hyphens or underscores; what is typed wins.
printf 'nonsense = 1\n' >bad.toml
expect 2 detect model.stl scan.ply -o out --config bad.toml
says bad.toml nonsense
expect 3 detect model.stl scan.ply -o out --config missing.toml
says missing.toml
printf 'unit = "parsec"\n' >unit.toml
expect 2 detect model.stl scan.ply -o out --config unit.toml
expect 3 detect model.stl scan.ply -o out --config unit.toml --unit mm
printf '[register]\nnonsense = 1\n[detect]\nunit = "parsec"\n' >section.toml
expect 2 detect model.stl scan.ply -o out --config section.toml
says parsec
absent out

# A result that cannot be written to standard output is told.
if [ -c /dev/full ]; then
  printf '0 0 0\n1 0 0\n0 1 0\n' >three.xyz
  "$asbuilt" info three.xyz --json >/dev/full 2>stderr
  [ $? -eq 4 ] || fail "a full standard output was not noticed"
fi
echo passed
