#!/bin/sh
# stack.sh FILE...: no program asks for an executable stack, and no object of an archive lacks the
# note that says so (an internal procedure used as a callback would do either).
set -u
bad=0
for file in "$@"; do
    case $file in
        *.a)
            objects=$(ar t "$file" | wc -l)
            notes=$(readelf -SW "$file" | grep -c 'note.GNU-stack')
            open=$(readelf -SW "$file" | grep 'note.GNU-stack' | grep -c ' X')
            [ "$objects" -gt 0 ] && [ "$notes" = "$objects" ] && [ "$open" = 0 ] ||
                { echo "$file: $objects objects, $notes notes, $open executable"; bad=1; } ;;
        *)
            readelf -lW "$file" | grep 'GNU_STACK' | grep -q 'RW ' ||
                { echo "$file: $(readelf -lW "$file" | grep GNU_STACK)"; bad=1; } ;;
    esac
done
exit $bad
