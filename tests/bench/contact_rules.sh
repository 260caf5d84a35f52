#!/bin/sh
# Test of gamboge bench contact-rules and of its picture: contact_rules.sh PROGRAM ROOT. Every rule has its figures, the picture is one.
set -u
program=$1
root=$2
command -v gnuplot >/dev/null || { echo "skipped: there is no gnuplot"; exit 77; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
failed=0

fail() {
    echo "$1"
    failed=1
}

"$program" bench contact-rules --quick --threads 1 --json "$folder/r.json" >"$folder/said" || fail "exit status $?: $(cat "$folder/said")"
for rule in event bridge bounce contact; do
    grep -q "\"rule\": \"$rule\"" "$folder/r.json" || fail "no figures of $rule"
done
grep '"reference": [0-9]' "$folder/r.json" | grep -q '"standard_error": [0-9]' || fail "no error beside a reference"
sh "$root/bench/contact_rules_plot.sh" "$folder/r.json" "$folder/p.png" 2>"$folder/said" || fail "the picture: $(cat "$folder/said")"
[ "$(head -c 4 "$folder/p.png" | tail -c 3)" = PNG ] || fail "no picture"
[ "$(wc -c <"$folder/p.png")" -gt 20000 ] || fail "a picture without curves"
sh "$root/bench/contact_rules_plot.sh" "$folder/r.json" 2>"$folder/said"
[ $? -eq 2 ] || fail "one argument is not bad use"
exit $failed
