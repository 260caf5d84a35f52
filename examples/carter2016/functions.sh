# Functions of examples/carter2016.sh, which sources them in its folder of results: runs, tables,
# pictures, page. They read what the script has set: program, root, rules and the sizes.
# shellcheck shell=bash disable=SC2154

configurations='0 1 2 3 4'
cores=$(nproc)

say() {
    printf '%4d s  %s\n' $((SECONDS - started)) "$*"
}

# scene NAME CONFIGURATION RANGE RULE COUNT DT START [OUTPUT]: writes runs/NAME.yaml, the scene of the
# examples with these values in it.
scene() {
    local file=runs/$1.yaml
    sed -e "s/^  count: .*/  count: $5/" -e "s/{rule: [a-z]*}/{rule: $4}/" -e "s/dt: [0-9.]*/dt: $6/" \
        -e "s|^  start: .*|  start: $7|" -e '/^output:/,$d' \
        "$root/examples/scenes/carter_c$2_$3.yaml" >"$file"
    printf '%s\n' "${8:-}" >>"$file"
    local words
    for words in "count: $5" "{rule: $4}" "dt: $6," "start: $7"; do
        grep -qF "$words" "$file" || complain "examples/scenes/carter_c$2_$3.yaml: no place for \"$words\""
    done
}

lattice() {
    echo "{lattice: triangular, vacancies: $vacancies, jitter: 0.05}"
}

# Keeps in $rules those that this version has.
settle_rules() {
    local rule kept=''
    for rule in $rules; do
        scene "rule_$rule" 1 short "$rule" 256 0.01 "$(lattice)"
        if "$program" check "runs/rule_$rule.yaml" >runs/check.log 2>&1; then
            kept="$kept $rule"
        else
            say "rule $rule is left out: $(tail -n 1 runs/check.log)"
        fi
    done
    rules=${kept# }
    [ -n "$rules" ] || complain "none of the rules is in this version"
    picture_rule=${rules%% *}
}

# run NAME STEPS: one run of one thread in the background, as soon as a core is free; its summary is
# runs/NAME.json, its complaint runs/NAME.log.
run() {
    while [ "$(jobs -rp | wc -l)" -ge "$cores" ]; do
        wait -n || true
    done
    "$program" run "runs/$1.yaml" --steps "$2" --threads 1 --quiet --json "runs/$1.json" >"runs/$1.log" 2>&1 &
}

# Number of a summary, "" where the run failed.
figure_of() {
    if [ -f "runs/$1.json" ]; then
        sed -n "s/^ \"$2\": \([-+.0-9e]*\),*\$/\1/p" "runs/$1.json"
    fi
}

# Names every run without a summary; fails if there is one.
all_ran() {
    local scene name status=0
    for scene in runs/C*.yaml; do
        name=${scene%.yaml}
        if [ ! -f "$name.json" ]; then
            echo "failed: $name.yaml: $(tail -n 1 "$name.log")" >&2
            status=1
        fi
    done
    return $status
}

# --- tables 6.2 and 6.5 ---

powers_of() {
    if [ "$1" = short ]; then echo "$short_powers"; else echo "$long_powers"; fi
}

# Line of the thesis's table for a range and N: five cells, empty where it has none.
thesis_line() {
    local table=6.5
    [ "$1" = short ] || table=6.2
    awk -F, -v table=$table -v n="$2" '$1 == table && $2 == n {print $3 "," $4 "," $5 "," $6 "," $7; found = 1}
        END {if (!found) print ",,,,"}' "$root/bench/carter2016.csv"
}

# table_of RANGE RULE: rounds_RANGE_RULE.csv, its plot, and the table on the screen.
table_of() {
    local file=rounds_$1_$2 number=6.5 power n c line
    [ "$1" = short ] || number=6.2
    {
        echo "# rounds of overlap correction a step, mean of $table_steps steps, $1 range, rule $2; thesis: table $number of Carter (2016)"
        echo "N,C0,C1,C2,C3,C4,C0 thesis,C1 thesis,C2 thesis,C3 thesis,C4 thesis"
        for power in $(powers_of "$1"); do
            n=$((1 << power)) line=
            for c in $configurations; do
                line=$line,$(figure_of "C${c}_$1_$2_$n" rounds_per_step)
            done
            echo "$n$line,$(thesis_line "$1" $n)"
        done
    } >"$file.csv"
    echo
    echo "Rounds a step, $1 range, for each configuration: table $number of the thesis, ours with rule $2 ($table_steps steps)"
    awk -F, '/^#/ {next} /^N/ {printf "%9s", "N"; for (c = 0; c < 5; c++) printf "    C%d:       ", c; print ""; next}
        {printf "%9d", $1; for (c = 2; c < 7; c++) printf "  %6s %6s", $(c + 5), $c; print ""}' "$file.csv"
    "$program" plot "$file.csv" --out "$file.png" --points thesis --log x \
        --ylabel 'rounds of overlap correction a step' \
        --title "$1 range, rule $2: lines ours, points table $number of Carter (2016)" >>runs/plot.log
}

make_tables() {
    local range rule power c n
    say "tables: $table_steps steps, C0 to C4, ranges $ranges, rules $rules"
    for range in $ranges; do
        for power in $(powers_of "$range"); do
            n=$((1 << power))
            for rule in $rules; do
                for c in $configurations; do
                    scene "C${c}_${range}_${rule}_$n" "$c" "$range" "$rule" "$n" 0.01 "$(lattice)"
                    run "C${c}_${range}_${rule}_$n" "$table_steps"
                done
            done
        done
        wait
        say "$range range done"
    done
    for range in $ranges; do
        for rule in $rules; do
            table_of "$range" "$rule"
        done
    done
    echo
}

# --- pictures 5.1 to 5.4 ---

# sheet OUT TITLE COLUMNS NAME...: one picture of the last frames, who took part in an overlap.
sheet() {
    local out=$1 title=$2 columns=$3 beside
    shift 3
    local first=runs/$1.nc
    shift
    beside=$(printf 'runs/%s.nc,' "$@")
    "$program" render "$first" --beside "$beside" --columns "$columns" --width "$picture_width" \
        --colour overlap --title "$title" --out "$out" >"runs/$out.log"
    pictures="$pictures $out"
}

# share FILE: one line of the shares of the particles that took part, C0 to C4, from what render said.
# Empty where frame 0 was drawn: that run did not come to its end.
shares() {
    sed -n 's/ //g; s/.*:frame\([0-9]*\)of.*pixels,\([0-9]*\)of\([0-9]*\)took.*/\1 \2 \3/p' "$1" |
        awk '{line = line ($1 > 0 ? sprintf(",%.4f", $2 / $3) : ",")} END {print line}'
}

names_of() { # names_of WORD: C0_WORD ... C4_WORD
    local c
    for c in $configurations; do
        printf 'C%s_%s ' "$c" "$1"
    done
}

particles_of() {
    if [ "$1" = short ]; then echo "$picture_n_short"; else echo "$picture_n_long"; fi
}

# The thesis's way: from the lattice, as many steps at every time step, so to different times.
thesis_way() { # thesis_way RANGE RULE
    local dt c name time
    for dt in $time_steps; do
        for c in $configurations; do
            name=C${c}_dt${dt}_$1_$2
            scene "$name" "$c" "$1" "$2" "$(particles_of "$1")" "$dt" "$(lattice)" \
                "output: {trajectory: {file: runs/$name.nc, every: $picture_steps, overlap: true}}"
            run "$name" "$picture_steps"
        done
    done
    wait
    echo "dt,C0,C1,C2,C3,C4" >"share_$1_$2.csv"
    for dt in $time_steps; do
        time=$(awk -v dt="$dt" -v n="$picture_steps" 'BEGIN {print dt * n}')
        # shellcheck disable=SC2046
        sheet "locality_$1_$2_dt$dt.png" "$1 range, rule $2: dt = $dt, after $picture_steps steps (time $time)" 3 \
            $(names_of "dt${dt}_$1_$2")
        echo "$dt$(shares "runs/locality_$1_$2_dt$dt.png.log")" >>"share_$1_$2.csv"
    done
}

# From one state, the last of the longest run, a little while with every time step: only dt differs.
same_state() { # same_state RANGE RULE
    local dt c name all=''
    for c in $configurations; do
        for dt in $time_steps; do
            name=C${c}_same_dt${dt}_$1_$2
            all="$all $name"
            scene "$name" "$c" "$1" "$2" "$(particles_of "$1")" "$dt" \
                "{file: runs/C${c}_dt0.01_$1_$picture_rule.nc, frame: -1}" \
                "output: {trajectory: {file: runs/$name.nc, every: $same_steps, overlap: true}}"
            run "$name" "$same_steps"
        done
    done
    wait
    # shellcheck disable=SC2086
    sheet "same_$1_$2.png" "$1 range, rule $2: from one state, $same_steps steps of dt = ${time_steps// /, }" 3 $all
    {
        echo "dt,C0,C1,C2,C3,C4"
        # Panels go through dt for every configuration; the table goes through configurations for every dt.
        shares "runs/same_$1_$2.png.log" | awk -F, -v steps="$time_steps" \
            '{n = split(steps, dt, " "); for (s = 1; s <= n; s++) print dt[s] "," $(s + 1) "," $(s + 1 + n) "," $(s + 1 + 2 * n) \
                "," $(s + 1 + 3 * n) "," $(s + 1 + 4 * n)}'
    } >"share_same_$1_$2.csv"
}

# A table over dt on the screen and its plot.
print_by_dt() { # print_by_dt FILE QUANTITY WORDS
    echo
    echo "$2, $3"
    awk -F, '/^#/ {next} {printf "%9s", $1; for (c = 2; c < 7; c++) printf "  %6s", $c; print ""}' "$1.csv"
    "$program" plot "$1.csv" --out "$1.png" --log x --title "$3" --ylabel "$2" >>runs/plot.log
}

# Rounds a step in the runs from one state.
late_rounds() { # late_rounds RANGE RULE
    local dt c line
    echo "dt,C0,C1,C2,C3,C4"
    for dt in $time_steps; do
        line=
        for c in $configurations; do
            line=$line,$(figure_of "C${c}_same_dt${dt}_$1_$2" rounds_per_step)
        done
        echo "$dt$line"
    done
}

make_pictures() {
    local range rule shown words share="Share of particles in an overlap in the last step"
    for range in $ranges; do
        shown=$picture_rule
        [ "$size" != full ] || shown=$rules
        for rule in $shown; do
            say "pictures: N = $(particles_of "$range"), $picture_steps steps at dt = ${time_steps// /, }, $range range, rule $rule"
            thesis_way "$range" "$rule"
            print_by_dt "share_${range}_$rule" "$share" "$range range, rule $rule, $picture_steps steps from the lattice"
        done
        for rule in $rules; do
            words="$range range, rule $rule, $same_steps steps from one state"
            same_state "$range" "$rule"
            print_by_dt "share_same_${range}_$rule" "$share" "$words"
            late_rounds "$range" "$rule" >"rounds_same_${range}_$rule.csv"
            print_by_dt "rounds_same_${range}_$rule" "Rounds of overlap correction a step" "$words"
        done
    done
    echo
}

# --- the page ---

make_page() {
    local name
    {
        echo '<!doctype html><meta charset="utf-8"><title>Carter (2016) and gamboge</title>'
        echo '<style>body{font:16px sans-serif;max-width:100em}img{max-width:100%}</style>'
        echo '<h1>Rounds of overlap correction a step</h1>'
        for name in rounds_*.csv; do
            [ -f "$name" ] || continue
            echo "<p><a href=\"$name\">$name</a><br><img src=\"${name%.csv}.png\" alt=\"$name\">"
        done
        echo '<h1>Who took part in an overlap in the last step</h1>'
        for name in share_*.csv; do
            [ -f "$name" ] || continue
            echo "<p><a href=\"$name\">$name</a><br><img src=\"${name%.csv}.png\" alt=\"$name\">"
        done
        for name in $pictures; do
            echo "<h2>$name</h2><p><a href=\"$name\"><img src=\"$name\" alt=\"$name\"></a>"
        done
    } >index.html
}
