# Small scenes, to be sourced.

# active FILE [LINE...]: 64 active discs, overlaps corrected, no output; more top-level lines after.
active() {
    file=$1
    shift
    cat >"$file" <<'END'
box: {packing: 0.5, shape: lattice}
particles:
  count: 64
  species:
    - {name: A, fraction: 0.5, diameter: 1, alpha: -1, mobility: 1}
    - {name: B, fraction: 0.5, diameter: 1, alpha: 1, mobility: -2}
  start: {lattice: triangular, jitter: 0.05}
forces:
  - {law: power, power: 6, sum: cutoff, cutoff: 2.5}
excluded_volume: {rule: bounce}
dynamics: {kind: brownian, dt: 0.01, temperature: 0.01, noise: {limit: 3, limit_by: clamp}}
END
    for line; do
        echo "$line" >>"$file"
    done
}
