# One line an interface body of gamboge_c.f90, in the form of signatures_c.awk; a type(c_ptr) by
# value is "any*", since it stands for every C pointer.
function class_of(type) {
    by_value = type ~ /value/
    if (type ~ /^character/) return "text*"
    if (type ~ /c_funptr/) return "fun"
    if (type ~ /c_ptr/) return by_value ? "any*" : "address*"
    kind = type ~ /c_double/ ? "r8" : type ~ /c_int64_t/ ? "i8" : type ~ /c_intptr_t/ ? "size" : "i4"
    return by_value ? kind : kind "*"
}
/^ *!/ { next }
/&$/ { sub(/&$/, ""); pending = pending $0; next }
{ line = pending $0; pending = "" }
line ~ /function gbg_/ && line !~ /end function/ {
    match(line, /gbg_[a-z0-9_]+/)
    name = substr(line, RSTART, RLENGTH)
    result = line ~ /type\(c_ptr\) function/ ? "text*" : "i4"
    open_at = index(line, name "(") + length(name)
    inner = substr(line, open_at + 1)
    sub(/\) *bind.*/, "", inner)
    gsub(/ /, "", inner)
    n = split(inner, argument, ",")
    split("", class)
    next
}
line ~ /::/ && name != "" {
    type = substr(line, 1, index(line, "::") - 1)
    sub(/^ +/, "", type)
    m = split(substr(line, index(line, "::") + 2), declared, ",")
    for (i = 1; i <= m; i++) {
        gsub(/[ ()*]/, "", declared[i])
        class[declared[i]] = class_of(type)
    }
}
line ~ /end function/ {
    out = name " result:" result
    for (i = 1; i <= n; i++) out = out " " argument[i] ":" class[argument[i]]
    print out
    name = ""
}
