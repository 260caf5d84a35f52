# Reads source files (paths relative to the root of the tree) and prints one line for each breach of
# the rules in docs/architecture.md: includes, words a room may not use, length, first line.

BEGIN {
    # What each room may include; a file name after the room narrows it to that header.
    may["core"] = "core public"
    may["scene"] = "scene core public"
    may["ewald"] = "ewald core public"
    may["fft"] = "fft core public"
    may["backend"] = "backend ewald fft core public cuda/simd_cuda.h"
    may["cuda"] = "cuda backend ewald core public"
    may["engine"] = "engine scene backend ewald core public"
    may["io"] = "io core public scene/scene.h engine/view.h"
    may["analysis"] = "analysis core public"
    may["api"] = "api engine scene backend core io analysis public"
    may["command"] = "command bench core public"
    may["bench"] = "bench backend ewald core public"
    may["public"] = "public"
    may["examples"] = "public"
    library = "^(core|ewald|fft|scene|backend|cuda|engine|io|analysis|api)$"
    # Words that only some files may use.
    owner["nc_[a-z0-9_]+"] = "^c/(io/|analysis/write|command/plot_data[.]c)"
    owner["fftwf?_[a-z]+"] = "^c/(analysis|fft)/"
    owner["c?yaml_[a-z]+"] = "^c/scene/"
    owner["cairo_[a-z]+"] = "^c/command/"
    owner["cuda[A-Z][A-Za-z0-9]+"] = "^cuda/"
    owner["gbg_cuda_[a-z_]+"] = "^cuda/"
    owner["(cub::|curand_|<<<)"] = "^cuda/"
    owner["__(global|device|host|shared|constant)__"] = "^(cuda/|c/core/inline[.]h)"
    owner["omp_[a-z_]+"] = "^c/(backend|ewald|fft|api|analysis|core)/"
    spoken = "(f?printf|vf?printf|f?puts|putchar|perror|assert|abort|_?exit|quick_exit|raise|signal) *[(]"
    streams = "std(in|out|err)"
    longest = 600
}

function breach(text) {
    printf "%s:%d: %s\n", FILENAME, FNR, text
    breaches++
}

# Room of a file: its folder under c/, public, bench, cuda, examples; "" for tests and the Fortran face.
function room_of(path,    part) {
    split(path, part, "/")
    if (part[1] == "c" && path ~ /^c\/[a-z]+\//) {
        return part[2]
    }
    if (part[1] == "include") {
        return "public"
    }
    return part[1] ~ /^(bench|cuda|examples)$/ ? part[1] : ""
}

# Room of an included name as seen from a file of room `here`.
function target_of(name, here) {
    if (name ~ /^\.\.\//) {
        return "(a path that climbs)"
    }
    if (name ~ /^gamboge\// || name == "version.h") {
        return "public"
    }
    if (name !~ /\//) {
        return here
    }
    return substr(name, 1, index(name, "/") - 1)
}

function word_at(text, pattern) {
    return text ~ ("(^|[^A-Za-z0-9_])" pattern)
}

# The line without comments, strings and characters; `inside` says whether a comment is open.
function bare(line,    out, c, two, quote) {
    out = ""
    quote = ""
    for (c = 1; c <= length(line); c++) {
        two = substr(line, c, 2)
        if (inside) {
            if (two == "*/") { inside = 0; c++ }
        } else if (quote != "") {
            if (substr(line, c, 1) == "\\") { c++ }
            else if (substr(line, c, 1) == quote) { quote = "" }
        } else if (two == "/*") { inside = 1; c++ }
        else if (two == "//") { break }
        else if (substr(line, c, 1) ~ /["']/) { quote = substr(line, c, 1) }
        else { out = out substr(line, c, 1) }
    }
    return out
}

FNR == 1 {
    room = room_of(FILENAME)
    is_c = FILENAME ~ /\.(c|cu|h|h\.in)$/
    inside = 0
    wanted = is_c ? "^/[*/]" : FILENAME ~ /\.(f90|f)$/ ? "^[!cC*]" : "^#"
    if ($0 !~ wanted) {
        breach("the first line is not a comment that says what the file is")
    }
}

FNR == longest + 1 {
    breach("more than " longest " lines: split it by meaning")
}

is_c && room != "" && /^[ \t]*#[ \t]*include[ \t]*["<]/ {
    name = $0
    sub(/^[ \t]*#[ \t]*include[ \t]*["<]/, "", name)
    sub(/[">].*/, "", name)
    if ($0 ~ /"/ || name ~ /^gamboge\//) {
        target = target_of(name, room)
        if ((" " may[room] " ") !~ (" " target " ") && (" " may[room] " ") !~ (" " name " ")) {
            breach("room " room " may not include " name)
        }
    }
}

is_c && /nc_|fftw|yaml_|cairo_|omp_|cu(da|b:|rand)|__|<<<|print|put|perror|assert|abort|exit|raise|signal|std/ || inside || /\/\*/ {
    if (!is_c) {
        next
    }
    text = bare($0)
    for (pattern in owner) {
        if (room != "" && word_at(text, pattern) && FILENAME !~ owner[pattern]) {
            breach("names of " pattern " belong to " owner[pattern])
        }
    }
    if (room ~ library) {
        if (word_at(text, spoken) || word_at(text, streams "([^A-Za-z0-9_.]|$)")) {
            breach("the library never prints, exits or aborts")
        }
    }
}

END {
    exit breaches > 0
}
