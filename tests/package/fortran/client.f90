! A client of the package in Fortran alone: a refusal with its message, then forces on three discs.
program client
   use gamboge
   implicit none
   integer, parameter :: n = 3, dp = kind(1d0)
   type(gbg_context_t) :: context
   real(dp) :: x(2, n), f(2, n)
   real(dp), parameter :: alpha(n) = [1d0, 1d0, -1d0], mobility(n) = [1d0, 1d0, -2d0]
   real(dp), parameter :: right(2, n) = &
      reshape([-0.5d0, 0d0, 0.1875d0, 0d0, 0.625d0, 0d0], [2, n])
   character(200) :: message
   integer :: status

   call context%create('abacus', stat=status, errmsg=message)
   if (status /= gbg_e_name .or. index(message, 'abacus') == 0) error stop 'not refused'

   x(:, 1) = [1d0, 5d0]
   x(:, 2) = [3d0, 5d0]
   x(:, 3) = [19d0, 5d0]
   call context%create('cpu:threads=1')
   call gbg_pair_forces(context, [20d0, 10d0], 2d0, x, alpha, mobility, f, precision='double')
   if (any(abs(f - right) > 1d-12)) error stop 'wrong forces'
   call context%destroy()
   print '(a)', gbg_version()//': right'
end program client
