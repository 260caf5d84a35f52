# One line a GBG_API function of the C headers: name, result class, then argument:class.
# Classes: i4 i8 r8 size fun by value, the same with * by address, text, handle (an object by
# address, "*"), address* (address of an address).
function class_of(type) {
    if (type ~ /\*.*\*/) return "address*"
    if (type ~ /char/) return "text*"
    if (type ~ /(struct|void) .*\*/) return "handle*"
    if (type ~ /gbg_log_sink|gbg_neighbours_batch/) return "fun"
    kind = type ~ /double/ ? "r8" : type ~ /int64_t/ ? "i8" : type ~ /ptrdiff_t/ ? "size" : "i4"
    return type ~ /\*/ ? kind "*" : kind
}
!/^#/ { text = text " " $0 }
END {
    while (start = index(text, "/*")) {
        rest = substr(text, start + 2)
        text = substr(text, 1, start - 1) " " substr(rest, index(rest, "*/") + 2)
    }
    while (match(text, /GBG_API [^;]*;/)) {
        call = substr(text, RSTART + 8, RLENGTH - 9)
        text = substr(text, RSTART + RLENGTH)
        open_at = index(call, "(")
        head = substr(call, 1, open_at - 1)
        match(head, /gbg_[a-z0-9_]+$/)
        line = substr(head, RSTART) " result:" class_of(substr(head, 1, RSTART - 1))
        inner = substr(call, open_at + 1)
        sub(/\)[^)]*$/, "", inner)
        n = inner ~ /^ *void *$/ ? 0 : split(inner, argument, ",")
        for (i = 1; i <= n; i++) {
            sub(/ +$/, "", argument[i])
            match(argument[i], /[A-Za-z0-9_]+$/)
            line = line " " substr(argument[i], RSTART) ":" \
                class_of(substr(argument[i], 1, RSTART - 1))
        }
        print line
    }
}
