! Counts what is not as it should be; `finish` ends a test program with status 1 if anything was.
module checking
   use, intrinsic :: iso_fortran_env, only: error_unit, real64
   implicit none
   private

   public :: check, check_text, check_close, finish

   integer, save :: checks = 0, failures = 0

contains

   subroutine check(ok, what)
      logical, intent(in) :: ok
      character(*), intent(in) :: what
      checks = checks + 1
      if (ok) return
      failures = failures + 1
      write (error_unit, '(a)') 'wrong: '//what
   end subroutine check

   subroutine check_text(has, wanted, what)
      character(*), intent(in) :: has, wanted, what
      call check(len(has) == len(wanted) .and. has == wanted, &
                 what//': "'//has//'" instead of "'//wanted//'"')
   end subroutine check_text

   subroutine check_close(has, wanted, tolerance, what)
      real(real64), intent(in) :: has, wanted, tolerance
      character(*), intent(in) :: what
      character(100) :: numbers
      write (numbers, '(es24.16,a,es24.16)') has, ' instead of ', wanted
      call check(abs(has - wanted) <= tolerance, what//': '//trim(numbers))
   end subroutine check_close

   subroutine finish()
      write (*, '(i0,a,i0,a)') checks, ' checks, ', failures, ' wrong'
      if (failures > 0 .or. checks == 0) error stop 1
   end subroutine finish
end module checking
