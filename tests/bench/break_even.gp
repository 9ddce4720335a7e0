# A step over the number of modes, serial and on two PEs, for each kind of
# chain.  Run in the folder of break_even.csv.
reset
set encoding utf8
set datafile separator comma
set datafile columnheaders
set border 3 linecolor '#404040'
set tics nomirror out scale 0.6
set grid linetype 1 linewidth 0.7 linecolor '#c0c0c0'
set key left top reverse Left samplen 2
set xlabel 'modes'
set ylabel 'us'
set logscale xy
set format y '%g'
set xtics (2, 4, 8, 16, 32, 64, 128, 256)
of(chain) = sprintf("<awk -F, 'NR == 1 || $1 == \"%s\"' break_even.csv", chain)
ways = 'serial threads threads_host lcm lcm_host'
names = "'serial' '2 PEs, threads' '2 PEs and host, threads' '2 PEs, LCM' '2 PEs and host, LCM'"
colours = '#202020 #d55e00 #e69f00 #009e73 #56b4e9'
draw = "set multiplot layout 1,3 title 'Median of a step: when do two PEs pay?'; \
    do for [c = 1:3] { \
        set title 'chain: '.word('general sticky reduce', c) noenhanced; \
        plot for [i = 1:5] of(word('general sticky reduce', c)) \
            using 'modes':(column(word(ways, i).'_median_us')) \
            with linespoints linewidth 1.6 pointtype 7 pointsize 0.6 \
            linecolor rgb word(colours, i) title word(names, i) noenhanced \
    }; \
    unset multiplot"
set terminal pngcairo size 1800,800 font 'DejaVu Sans,13' background '#ffffff'
set output 'break_even.png'
eval draw
set terminal svg size 1800,800 font 'DejaVu Sans,sans-serif,13' background '#ffffff'
set output 'break_even.svg'
eval draw
