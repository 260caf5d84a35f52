C     An old code: fixed form, implicit types, COMMON arrays larger than
C     the number of particles. Forces, overlaps and noise come from
C     gamboge on these very arrays, and agree with the code's own loop.
      PROGRAM COMMON77
      USE GAMBOGE
      IMPLICIT DOUBLE PRECISION (A-H, O-Z)
      PARAMETER (NMAX = 100, N = 40)
      COMMON /ATOMS/ RX(NMAX), RY(NMAX), FX(NMAX), FY(NMAX)
      COMMON /CHARGE/ AL(NMAX), AM(NMAX), D(NMAX)
      DIMENSION GX(NMAX), GY(NMAX), BOX(2)
      TYPE(GBG_CONTEXT_T) CTX
      CHARACTER*200 MSG
      INTEGER ISTAT
      BOX(1) = 8.D0
      BOX(2) = 10.D0
      DO 10 I = 1, N
         RX(I) = MOD(3.1735911D0*I, BOX(1)) - 4.D0
         RY(I) = MOD(1.2907193D0*I*I, BOX(2)) + 20.D0
         AL(I) = 1.D0 + MOD(I, 2)
         AM(I) = 1.D0 - MOD(I, 3)
         D(I) = 0.9D0
   10 CONTINUE
      CALL CTX%CREATE('cpu')
      CALL GBG_PAIR_FORCES(CTX, BOX, 2.D0, RX(1:N), RY(1:N), AL(1:N),
     &   AM(1:N), FX(1:N), FY(1:N), PRECISION='double', STAT=ISTAT,
     &   ERRMSG=MSG)
      IF (ISTAT .NE. 0) THEN
         WRITE (*, *) MSG
         STOP 1
      END IF
      CALL LOOP(N, BOX, GX, GY)
      BIG = 0.D0
      DIF = 0.D0
      DO 20 I = 1, N
         BIG = MAX(BIG, ABS(GX(I)), ABS(GY(I)))
         DIF = MAX(DIF, ABS(FX(I) - GX(I)), ABS(FY(I) - GY(I)))
   20 CONTINUE
      WRITE (*, *) 'largest force', BIG, ' difference', DIF
      IF (.NOT. DIF .LE. 1.D-12*BIG) STOP 1
      CALL GBG_OVERLAPS_FIND(CTX, BOX, RX(1:N), RY(1:N), D(1:N), NPAIR)
      CALL GBG_OVERLAPS_REMOVE(CTX, BOX, RX(1:N), RY(1:N), D(1:N),
     &   ROUNDS=NROUND)
      CALL GBG_OVERLAPS_FIND(CTX, BOX, RX(1:N), RY(1:N), D(1:N), NLEFT)
      WRITE (*, *) 'overlaps', NPAIR, ' rounds', NROUND, ' left', NLEFT
      IF (NPAIR .EQ. 0 .OR. NROUND .EQ. 0 .OR. NLEFT .NE. 0) STOP 1
      CALL GBG_NORMALS(CTX, 7, 0, 1, 0, GX(1:N), GY(1:N))
      WRITE (*, *) 'first deviates', GX(1), GY(1)
      END

C     The code's own loop over pairs.
      SUBROUTINE LOOP(N, BOX, GX, GY)
      IMPLICIT DOUBLE PRECISION (A-H, O-Z)
      PARAMETER (NMAX = 100)
      COMMON /ATOMS/ RX(NMAX), RY(NMAX), FX(NMAX), FY(NMAX)
      COMMON /CHARGE/ AL(NMAX), AM(NMAX), D(NMAX)
      DIMENSION GX(*), GY(*), BOX(2)
      DO 20 I = 1, N
         GX(I) = 0.D0
         GY(I) = 0.D0
         DO 10 K = 1, N
            IF (K .EQ. I) GO TO 10
            X = RX(I) - RX(K)
            Y = RY(I) - RY(K)
            X = X - BOX(1)*ANINT(X/BOX(1))
            Y = Y - BOX(2)*ANINT(Y/BOX(2))
            W = AM(I)*AL(K)/SQRT(X*X + Y*Y)**3
            GX(I) = GX(I) + W*X
            GY(I) = GY(I) + W*Y
   10    CONTINUE
   20 CONTINUE
      END
