! Example: a code that keeps its own particles replaces its loop over pairs, which stops at the nearest
! images, by the sum over all images: the lines of `forces` take the place of the loop.
program lattice_sum
   use, intrinsic :: iso_fortran_env, only: real64
   use gamboge
   implicit none
   integer, parameter :: n = 1000, steps = 20
   real(real64), parameter :: side(2) = [40.0_real64, 25.0_real64], dt = 1e-3_real64
   type(gbg_context_t) :: context
   type(gbg_sum_t) :: forces
   real(real64) :: x(n), y(n), fx(n), fy(n), alpha(n), mobility(n), potential(n)
   real(real64) :: error, relative, drift
   integer :: i, step

   call context%create('auto')
   do i = 1, n   ! a loose square lattice, shaken
      x(i) = mod(i - 1, 40) + 0.25_real64*sin(12.9898_real64*i)
      y(i) = (i - 1)/40 + 0.25_real64*sin(78.233_real64*i)
   end do
   alpha = [(merge(1, -1, mod(i, 2) == 1), i=1, n)]
   mobility = [(merge(1, -2, mod(i, 2) == 1), i=1, n)]

   call forces%create(context, side, 2.0_real64, n, tolerance=1e-6_real64)
   call forces%set_option('hurry', 'true')   ! few steps: no tuning
   call forces%set_sources(alpha)
   do step = 1, steps
      call forces%set_positions(x, y)
      call forces%run()
      call forces%get_forces(fx, fy, mobility=mobility)
      x = x + fx*dt   ! your own dynamics
      y = y + fy*dt
   end do

   call forces%get_potential(potential)
   call forces%get_error(error, relative)
   drift = sum(alpha/mobility*fx)/n   ! zero: forces of pairs
   print '(a,1x,f0.6)', 'rms_force', sqrt(sum(fx**2 + fy**2)/n)
   print '(a,1x,f0.4)', 'energy', 0.5_real64*sum(alpha*potential)
   print '(a,1x,i0)', 'error_below_1e-6', merge(1, 0, error < 1e-6_real64)
   print '(a,1x,i0)', 'momentum_below_1e-8', merge(1, 0, abs(drift) < 1e-8_real64)
end program lattice_sum
