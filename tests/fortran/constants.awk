# Names of the integer constants in the public headers: entries of the status list, enumerators.
/^ *\/?\*/ { next }
{
    line = $0
    while (match(line, /X\(GBG_[A-Z0-9_]+|GBG_[A-Z0-9_]+ = /)) {
        name = substr(line, RSTART, RLENGTH)
        gsub(/X\(| = /, "", name)
        print name
        line = substr(line, RSTART + RLENGTH)
    }
}
