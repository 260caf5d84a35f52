# shellcheck shell=sh
# Sourced by the scripts here: reads the options of the command line, whose names are in $options, into variables of these names.
# What is left of the command line stays. $script is the script's name, usage its text.

complain() {
    echo "$script: $*" >&2
    exit 2
}

# shellcheck disable=SC2154
while [ $# -gt 0 ]; do
    case $1 in
    --help | -h)
        usage
        exit
        ;;
    --*)
        case " $options " in
        *" ${1#--} "*) [ "${1#* }" = "$1" ] || complain "there is no option $1 (--help lists them)" ;;
        *) complain "there is no option $1 (--help lists them)" ;;
        esac
        [ $# -gt 1 ] || complain "$1 needs a value"
        eval "${1#--}=\$2"
        shift 2
        ;;
    -*) complain "there is no option $1 (--help lists them)" ;;
    *) break ;;
    esac
done
