! The structure factor through the module against plain sums over particles, in every layout.
program analysis
   use, intrinsic :: iso_fortran_env, only: int64, real64
   use checking, only: check, check_close, finish
   use gamboge
   implicit none
   integer, parameter :: n = 50
   real(real64), parameter :: pi = acos(-1.0_real64), edge = 8
   type(gbg_context_t) :: context
   type(gbg_analysis_t) :: sk
   real(real64) :: x(2, n), deep(3, n), line(2*n)
   real(real64), allocatable, save :: k(:), s(:), wanted(:), values(:), errors(:)
   integer :: species(n), i, a, shells, frames, stat
   integer(int64) :: long_shells
   character(:), allocatable, save :: text
   character(300) :: errmsg

   do i = 1, n
      do a = 1, 2
         x(a, i) = edge*modulo(0.6180339887498949_real64*i*a + 0.31_real64*a*i*i, 1.0_real64)
      end do
   end do
   deep = -3
   deep(:2, :) = x
   line = reshape(x, [2*n])
   species = [(1 + modulo(i, 2), i=1, n)]
   call context%create('cpu')

   call sk%add_frame(x, stat=stat)
   call check(stat == gbg_e_argument, 'an analysis that was not created')
   call begin()
   call sk%add_frame(x, species)
   call sk%get_size(shells, frames)
   call sk%get_size(long_shells)
   call check(shells > 3 .and. frames == 1 .and. long_shells == shells, 'sizes')
   call sk%get('k', k)
   call sk%get('S', wanted)
   call check(size(k) == shells .and. size(wanted) == shells, 'one value a shell')
   ! The first shell holds (1,0), (0,1), (1,1), (1,-1), in units of 2 pi/edge.
   call check_close(k(1), pi/edge*(1 + sqrt(2.0_real64)), 1e-12_real64, 'first k')
   call check_close(wanted(1), (plain(1, 0) + plain(0, 1) + plain(1, 1) + plain(1, -1))/4, &
                    1e-10_real64, 'first S(k)')
   call sk%get_partial(1, 1, values, errors)
   call sk%get_partial(1, 2, s)
   call check(size(errors) == shells, 'errors')
   call sk%get_partial(2, 2, errors)
   call check_close(maxval(abs((values + errors)/2 + s - wanted)), 0.0_real64, 1e-10_real64, &
                    'partials add up')
   call sk%get_partial(0, 1, values, stat=stat)
   call check(stat == gbg_e_argument, 'species 0')
   call sk%get('teapot', values, stat, errmsg)
   call check(stat == gbg_e_name, 'no such quantity: '//trim(errmsg))
   call sk%describe(text)
   call check(index(text, 'direct') > 0, 'describe: '//text)

   call begin()
   call sk%add_frame(deep, species)
   call same('x(3,n) in 2D')
   call begin()
   call sk%add_frame(x(:, n:1:-1), int(species(n:1:-1), int64))
   call same('reversed, species int64')
   call begin()
   call sk%add_frame(line(1::2), line(2::2), species=species)
   call same('separate')
   call begin()
   call sk%add_frame(x(1, :), line(2::2), species=species, lengths=[edge, edge])
   call same('separate, own box')
   call begin()
   call sk%add_frame(x(:, :n - 1), species(:n - 1), stat=stat)
   call check(stat == gbg_ok, 'another number of particles')
   call sk%add_frame(x, species, stat=stat)
   call check(stat /= gbg_ok, 'a frame with more particles than the first')
   call sk%add_frame(x(:, :n - 1), species, stat=stat)
   call check(stat == gbg_e_argument, 'more species than particles')
   call sk%add_frame(x(:, :n - 1), species(:n - 1), lengths=[edge], stat=stat)
   call check(stat == gbg_e_argument, 'one length in two dimensions')
   call begin()
   call sk%add_frame(real(x), species, storage_error=1e-6)
   call sk%get('S', s)
   call check(maxval(abs(s - wanted)) < 1e-4, 'single precision')

   call sk%set_species_name(2, 'second')
   call sk%set_attribute('title', 'a test')
   call sk%write('analysis_test.nc', stat, errmsg)
   call check(stat == merge(gbg_ok, gbg_e_unbuilt, gbg_has_component('netcdf')), &
              'write: '//trim(errmsg))
   call finish()

contains

   subroutine begin()
      call sk%destroy()
      call sk%create(context, [edge, edge], n_species=2)
      call sk%set('method', 'direct')
      call sk%set('partials', 'yes')
      call sk%set('k_max', 6.0_real64)
      call sk%set('tolerance', 1e-12_real64)
   end subroutine begin

   ! |sum_j exp(i k r_j)|**2/n at k = 2 pi/edge (h, l).
   real(real64) function plain(h, l)
      integer, intent(in) :: h, l
      real(real64) :: phase(n)
      phase = 2*pi/edge*(h*x(1, :) + l*x(2, :))
      plain = (sum(cos(phase))**2 + sum(sin(phase))**2)/n
   end function plain

   subroutine same(what)
      character(*), intent(in) :: what
      call sk%get('S', s)
      call check_close(maxval(abs(s - wanted)), 0.0_real64, 1e-10_real64, what)
   end subroutine same
end program analysis
