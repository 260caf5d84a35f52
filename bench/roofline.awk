# Reads what `ncu --csv --metrics` prints, a metric a line, and prints a kernel a row: its mean time, how near it comes to each roof,
# the highest of them, and, where that is below 70 %, what its warps wait for most. -v scene=TEXT names the runs, -v head=1 prints the
# head of the table.

# Fields of a line of CSV, quoted or not, into cell[1..].
function split_line(line, cell,    n, c, quoted, text, length_of) {
    split("", cell)
    n = 1
    quoted = 0
    text = ""
    length_of = length(line)
    for (c = 1; c <= length_of; c++) {
        letter = substr(line, c, 1)
        if (letter == "\"") {
            if (quoted && substr(line, c + 1, 1) == "\"") { text = text letter; c++ }
            else { quoted = !quoted }
        } else if (letter == "," && !quoted) {
            cell[n++] = text
            text = ""
        } else { text = text letter }
    }
    cell[n] = text
    return n
}

# The name without arguments, templates, name spaces and the type before it.
function short_name(name,    depth, c, letter, out) {
    gsub(/\(anonymous namespace\)::|<unnamed>::/, "", name)
    out = ""
    depth = 0
    for (c = 1; c <= length(name); c++) {
        letter = substr(name, c, 1)
        if (letter == "<") { depth++ }
        else if (letter == ">") { depth-- }
        else if (letter == "(" && depth == 0) { break }
        else if (depth == 0) { out = out letter }
    }
    sub(/^.* /, "", out)
    sub(/^.*::/, "", out)
    return out
}

# Numbers come with separators of thousands; units of time and size may be scaled.
function number(text, unit) {
    gsub(/,/, "", text)
    if (text !~ /^[-+]?[0-9.]+([eE][-+]?[0-9]+)?$/) { return "" }
    if (unit ~ /^(us|usecond)$/) { return text * 1e3 }
    if (unit ~ /^(ms|msecond)$/) { return text * 1e6 }
    if (unit ~ /^(s|second)$/) { return text * 1e9 }
    if (unit ~ /^Kbyte$/) { return text * 1e3 }
    if (unit ~ /^Mbyte$/) { return text * 1e6 }
    if (unit ~ /^Gbyte$/) { return text * 1e9 }
    return text + 0
}

BEGIN {
    roofs = split("sm__inst_issued.avg.pct_of_peak_sustained_active " \
                  "sm__inst_executed_pipe_xu.avg.pct_of_peak_sustained_active " \
                  "sm__inst_executed_pipe_alu.avg.pct_of_peak_sustained_active " \
                  "sm__inst_executed_pipe_fma.avg.pct_of_peak_sustained_active " \
                  "sm__inst_executed_pipe_fp64.avg.pct_of_peak_sustained_active " \
                  "l1tex__throughput.avg.pct_of_peak_sustained_active " \
                  "lts__throughput.avg.pct_of_peak_sustained_elapsed " \
                  "dram__throughput.avg.pct_of_peak_sustained_elapsed", roof, " ")
    split("issue,xu,alu,fma,fp64,L1,L2,HBM", roof_name, ",")
    stalled = "smsp__average_warps_issue_stalled_"
    if (head) {
        printf "%-22s %-20s %6s %9s %9s %4s %5s", "scene", "kernel", "runs", "us each", "HBM MB", "regs", "occ%"
        for (r = 1; r <= roofs; r++) { printf " %6s", roof_name[r] "%" }
        printf " %6s  %-6s %6s  %s\n", "SM%", "roof", "of it", "waits for (warps stalled an issue)"
    }
}

/^"?ID"?,/ {
    n = split_line($0, cell)
    for (c = 1; c <= n; c++) { column[cell[c]] = c }
    named = ("Kernel Name" in column) && ("Metric Name" in column)
    next
}

named && /^"?[0-9]+"?,/ {
    split_line($0, cell)
    value = number(cell[column["Metric Value"]], cell[column["Metric Unit"]])
    if (value == "") { next }
    kernel = short_name(cell[column["Kernel Name"]])
    metric = cell[column["Metric Name"]]
    if (!(kernel in known)) {
        known[kernel] = 1
        order[++kernels] = kernel
    }
    id = cell[column["ID"]]
    if (metric == "gpu__time_duration.sum") {
        time_of[kernel, id] = value
        if (value > longest[kernel]) { longest[kernel] = value }
    }
    seen[kernel, id, metric] = value
}

# Launches behind the end of a batch of steps return at once: they are left out.
function add_up(    key, part) {
    for (key in seen) {
        split(key, part, SUBSEP)
        if (time_of[part[1], part[2]] * 10 >= longest[part[1]]) {
            sum[part[1], part[3]] += seen[key]
            count[part[1], part[3]]++
        }
    }
}

function mean(kernel, metric) {
    return count[kernel, metric] ? sum[kernel, metric] / count[kernel, metric] : -1
}

function cell_of(value, format) {
    return value < 0 ? "-" : sprintf(format, value)
}

# What most warps wait for between two issues: name and number of warps.
function top_stall(kernel,    key, part, best, name, value) {
    best = -1
    for (key in sum) {
        split(key, part, SUBSEP)
        if (part[1] != kernel || index(part[2], stalled) != 1 || part[2] ~ /_(selected|not_selected)_per/) { continue }
        value = mean(kernel, part[2])
        if (value > best) {
            best = value
            name = part[2]
        }
    }
    if (best < 0) { return "-" }
    name = substr(name, length(stalled) + 1)
    sub(/_per_issue_active.*/, "", name)
    gsub(/_/, " ", name)
    return sprintf("%s (%.1f)", name, best)
}

function row(kernel,    r, value, best, best_name) {
    best = -1
    printf "%-22s %-20s %6d %9s %9s %4s %5s", scene, substr(kernel, 1, 20), count[kernel, "gpu__time_duration.sum"],
        cell_of(mean(kernel, "gpu__time_duration.sum") / 1e3, "%.2f"), cell_of(mean(kernel, "dram__bytes.sum") / 1e6, "%.3g"),
        cell_of(mean(kernel, "launch__registers_per_thread"), "%.0f"),
        cell_of(mean(kernel, "sm__warps_active.avg.pct_of_peak_sustained_active"), "%.0f")
    for (r = 1; r <= roofs; r++) {
        value = mean(kernel, roof[r])
        printf " %6s", cell_of(value, "%.1f")
        if (value > best) {
            best = value
            best_name = roof_name[r]
        }
    }
    printf " %6s  %-6s %6s  %s\n", cell_of(mean(kernel, "sm__throughput.avg.pct_of_peak_sustained_elapsed"), "%.1f"), best_name,
        cell_of(best, "%.0f%%"), (best >= 0 && best < 70 ? top_stall(kernel) : "")
}

END {
    add_up()
    for (k = 1; k <= kernels; k++) { row(order[k]) }
    exit kernels == 0
}
